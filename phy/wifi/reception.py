"""Finds and reads 802.11a frames in samples at 20 Msps."""

import cmath
import math
from collections.abc import Iterator
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from phy import compute, ofdm, preamble
from phy.constellation import Modulation
from phy.demodulation import Demodulator
from phy.estimation import in_planes, new_channel, new_scratch, tones
from phy.numerology import OFDM_64_16
from phy.tables.acquisition import BACKOFF
from phy.tables.block import ArgumentBlock
from phy.tables.burst import DUE, Channel
from phy.wifi.bits import Rate, Signal, has_right_fcs, parse_data, parse_signal
from phy.wifi.high_throughput import HT_SIG_SYMBOLS, HtSignal, parse_ht_signal

RATE_HZ = 20e6
HT_LEGACY_MBPS = 6
"""Rate in Mbit/s that an 802.11n frame in mixed format announces to 802.11a receivers."""

_GRID = OFDM_64_16
_SEGMENT = preamble.SEGMENT
_WINDOW = 96
"""Samples over which the repetition of the short training is measured."""
_ALIKE = 0.6
"""Least |Σ x[n + 16] x*[n]| / Σ |x|² of a repetition."""
_AFTER_SHORT = 320
"""Number of samples from the start of the repetition in which the long training ends."""
_MATCH = 0.35
"""Least share of a window's power in a long symbol."""


class WifiFrame(NamedTuple):
    """A frame with a valid SIGNAL field; `start` is the first sample of its first long symbol."""

    start: int
    rate: Rate
    psdu: bytes
    is_right: bool
    """Whether the frame's FCS is correct."""
    snr_db: float
    cfo_hz: float


class HtFrame(NamedTuple):
    """An 802.11n frame, of which only the HT-SIG field is read.

    `start` is the first sample of its first long symbol. In mixed format it begins as an 802.11a
    frame of 6 Mbit/s; in greenfield format it does not.
    """

    start: int
    signal: HtSignal
    is_greenfield: bool
    snr_db: float
    cfo_hz: float
    end: int
    """End of the frame according to the preamble; in greenfield format the end of HT-SIG."""


def receive(samples: NDArray[np.complex64]) -> Iterator[WifiFrame | HtFrame]:
    """The frames in `samples`, complex64 at 20 Msps, in order."""
    at = 0
    for begin in map(int, _repetitions(samples)):
        if begin < at:
            continue
        frame = _read(samples, begin)
        if frame is not None:
            yield frame
            if isinstance(frame, HtFrame):
                at = frame.end
                continue
            at = _end(frame.start, 1 + frame.rate.n_symbols(len(frame.psdu)))


def _repetitions(x: NDArray[np.complex64]) -> NDArray[np.int64]:
    """Samples at which a sustained repetition every 16 samples begins."""
    wide = x.astype(np.complex128)
    product = wide[_SEGMENT:] * wide[:-_SEGMENT].conj()
    power = np.abs(wide[_SEGMENT:]) ** 2
    sums = [np.cumsum(np.concatenate(([0], each))) for each in (product, power)]
    alike, whole = (each[_WINDOW:] - each[:-_WINDOW] for each in sums)
    high = np.abs(alike) > _ALIKE * np.maximum(whole.real, 1e-12)
    edges = np.flatnonzero(np.diff(high.astype(np.int8), prepend=0, append=0))
    begins, ends = edges[::2], edges[1::2]
    found: NDArray[np.int64] = begins[ends - begins >= _SEGMENT]
    return found


def _end(start: int, n_symbols: int) -> int:
    """Index after `n_symbols` symbols, the first of which is SIGNAL; `start`: first long symbol."""
    return start + 2 * _GRID.n_fft + n_symbols * _GRID.n_symbol


def _read(samples: NDArray[np.complex64], begin: int) -> WifiFrame | HtFrame | None:
    training = samples[begin : begin + _WINDOW + _SEGMENT]
    lag = np.vdot(training[:-_SEGMENT], training[_SEGMENT:])
    coarse = cmath.phase(lag) / (2 * math.pi * _SEGMENT)
    found = _long_training(samples, begin, coarse)
    if found is None:
        return None
    start, frequency = found
    window = start - BACKOFF
    channel = _channel(samples, window, frequency)
    signal_window = window + 2 * _GRID.n_fft + _GRID.n_cp
    llr = _llrs(samples, window, signal_window, 1, frequency, channel, Modulation.BPSK, 0)
    signal = parse_signal(llr) if llr is not None else None
    # Keep the noise measured on the training: the following symbols only refine the channel.
    ratio = channel.content.gain / channel.content.no
    snr_db = 10 * math.log10(ratio * _GRID.n_used / _GRID.n_fft)
    cfo_hz = frequency * RATE_HZ
    at = partial(_ht_signal, samples, window, signal_window, frequency)
    if (ht := at(0)) is not None:
        return HtFrame(start, ht, True, snr_db, cfo_hz, _end(start, HT_SIG_SYMBOLS))
    if signal is None:
        return None
    if signal.rate.mbps == HT_LEGACY_MBPS and (ht := at(1)) is not None:
        n_symbols = 1 + signal.rate.n_symbols(signal.n_bytes)
        return HtFrame(start, ht, False, snr_db, cfo_hz, _end(start, n_symbols))
    psdu = _psdu(samples, window, signal_window + _GRID.n_symbol, frequency, channel, signal)
    if psdu is None:
        return None
    right = has_right_fcs(psdu)
    return WifiFrame(start, signal.rate, psdu, right, snr_db, cfo_hz)


def _ht_signal(
    samples: NDArray[np.complex64],
    window: int,
    signal_window: int,
    frequency: float,
    first_symbol: int,
) -> HtSignal | None:
    """The HT-SIG field from symbol `first_symbol` after the training on, or None."""
    points = np.zeros((HT_SIG_SYMBOLS, _GRID.n_data), np.complex64)
    begin = signal_window + first_symbol * _GRID.n_symbol
    # A separate channel, so that these points do not affect the estimate. They are not decided.
    channel = _channel(samples, window, frequency)
    channel.content.figures[DUE] = np.inf
    llr = _llrs(
        samples, window, begin, HT_SIG_SYMBOLS, frequency, channel, Modulation.BPSK, first_symbol,
        points,
    )  # fmt: skip
    return None if llr is None else parse_ht_signal(points)


def _long_training(
    samples: NDArray[np.complex64], begin: int, coarse: float
) -> tuple[int, float] | None:
    """(first sample of the long training's first echo, frequency in cycles a sample), or None."""
    n = _GRID.n_fft
    span = samples[begin : begin + _AFTER_SHORT + 2 * n]
    if len(span) < 4 * n:
        return None
    x = span * np.exp(-2j * np.pi * coarse * np.arange(len(span)))
    known = preamble.long_symbol(_GRID)
    match = np.abs(np.correlate(x, known, "valid")) ** 2
    both = match[:-n] + match[n:]
    peak = int(both.argmax())
    power = np.sum(np.abs(x[peak : peak + 2 * n]) ** 2)
    if both[peak] < _MATCH * n * power / 2:
        return None
    # As in `phy.kernels.timing`: the first echo with a tenth of the strongest echo's power.
    nearby = both[max(0, peak - 12) : peak + 1]
    start = peak + 1 - len(nearby) + int(np.argmax(nearby >= 0.1 * both[peak]))
    lag = np.vdot(x[peak : peak + n], x[peak + n : peak + 2 * n])
    return begin + start, coarse + cmath.phase(lag) / (2 * math.pi * n)


def _channel(
    samples: NDArray[np.complex64], window: int, frequency: float
) -> ArgumentBlock[Channel]:
    starts = _GRID.n_fft * np.arange(preamble.N_LONG)
    y = ofdm.to_tones(samples[window:], starts, frequency, 0j, _GRID)
    sent = preamble.long_subcarriers(_GRID)[_GRID.tones].astype(np.complex64)
    channel, known = new_channel(_GRID), in_planes(np.tile(sent, (preamble.N_LONG, 1)))
    compute.learn_channel(y, known, tones(_GRID), channel, new_scratch(_GRID))
    return channel


def _llrs(
    samples: NDArray[np.complex64],
    origin: int,
    window: int,
    n_symbols: int,
    frequency: float,
    channel: ArgumentBlock[Channel],
    modulation: Modulation,
    first_symbol: int,
    points: NDArray[np.complex64] | None = None,
) -> NDArray[np.int16] | None:
    """LLRs of `n_symbols` symbols with FFT windows from `window` on; None if samples are missing.

    `points`, if given, gets the equalised points.
    """
    last = window + (n_symbols - 1) * _GRID.n_symbol + _GRID.n_fft
    if last > len(samples):
        return None
    llr = np.empty(n_symbols * _GRID.n_data * modulation.bits, np.int16)
    powers, hidden = np.empty(n_symbols, np.float32), np.empty(n_symbols)
    Demodulator(_GRID).demodulate(
        samples[window:last], frequency, 0j, window - origin, modulation, channel, first_symbol,
        llr, powers, hidden, points,
    )  # fmt: skip
    return llr


def _psdu(
    samples: NDArray[np.complex64],
    origin: int,
    window: int,
    frequency: float,
    channel: ArgumentBlock[Channel],
    signal: Signal,
) -> bytes | None:
    rate, n_symbols = signal.rate, signal.rate.n_symbols(signal.n_bytes)
    llr = _llrs(samples, origin, window, n_symbols, frequency, channel, rate.modulation, 1)
    return None if llr is None else parse_data(llr, signal)
