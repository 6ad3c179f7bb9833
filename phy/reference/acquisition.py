"""Acquisition: from the detector's peak to a decoded header and a known channel."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from phy import preamble
from phy.constellation import Modulation
from phy.cuts import Cuts
from phy.header import BurstHeader, n_symbols
from phy.numerology import Numerology
from phy.quality import BurstQuality
from phy.reference.channel import Channel
from phy.reference.equaliser import Equaliser
from phy.reference.header import folded, parse_header
from phy.reference.ofdm import Samples, Subcarriers, to_subcarriers, turned_back
from phy.reference.offset import BACKOFF, refine
from phy.reference.timing import SEARCH, locate, templates
from phy.reference.tracking import Tracking
from phy.reference.training import estimate, learn
from phy.reference.transmitter import header_samples


class Acquired(NamedTuple):
    """An acquired burst: its header is decoded, and its payload can be equalised.

    `origin` is the absolute index at which samples rotated back by `frequency` have phase 0, and
    `window` the index at which the first payload symbol's FFT begins.
    """

    header: BurstHeader
    quality: BurstQuality
    origin: int
    window: int
    frequency: float
    equaliser: Equaliser


class Missed(NamedTuple):
    """A failed acquisition: no "preamble" was found, or its "header" could not be decoded."""

    stage: str


def before(grid: Numerology) -> int:
    """Number of samples that acquisition needs before the nominal first long symbol."""
    return preamble.long_start(grid) + SEARCH + BACKOFF


def needed_after(grid: Numerology) -> int:
    """Number of samples that acquisition needs from the nominal first long symbol on."""
    return SEARCH + preamble.N_LONG * grid.n_fft + n_symbols(grid) * grid.n_symbol


class Acquisition:
    """Acquires bursts on one grid, for offsets up to `max_frequency` cycles per sample.

    `centre_cycles` is the centre frequency in cycles per sample if it comes from the same crystal;
    0: unknown.
    """

    def __init__(self, grid: Numerology, max_frequency: float, centre_cycles: float = 0.0) -> None:
        self._grid = grid
        self._centre_cycles = centre_cycles
        self._templates = templates(grid, max_frequency)
        long = preamble.long_start(grid) + grid.n_fft * np.arange(preamble.N_LONG)
        header = preamble.length(grid) + grid.n_cp + grid.n_symbol * np.arange(n_symbols(grid))
        self._windows = np.concatenate((long, header))
        self._long = np.tile(preamble.long_subcarriers(grid), (preamble.N_LONG, 1)).astype(complex)

    def acquire(
        self,
        x: NDArray[np.complex64],
        base: int,
        coarse: float,
        dc: complex,
        cuts: Cuts | None = None,
    ) -> Acquired | Missed:
        """Decode the header of the burst whose first long symbol is nominally at `x[before(grid)]`.

        `base` is the absolute index of `x[0]`, `coarse` the frequency of the peak, modulo 1/16
        cycles per sample. `cuts` is what an excisor took out. A subcarrier that it cut anywhere is
        left out of training and header.
        """
        grid = self._grid
        kept = whole = None
        if cuts is not None:
            kept = cuts.kept(
                np.arange(base + before(grid), base + len(x), grid.n_fft), coarse, grid
            )
            # About where the header is: it need not be known better.
            about = base + before(grid) - self._windows[0] + self._windows[preamble.N_LONG :]
            whole = cuts.whole(about, grid)
        always = np.ones(grid.n_used, np.float32) if kept is None else kept.min(0)
        # 2. Timing and offset.
        first = before(grid) - SEARCH
        found = locate(turned_back(x[first:], dc, coarse), self._templates)
        if found is None:
            return Missed("preamble")
        early, correction = found
        begin = first + early - preamble.long_start(grid) - BACKOFF
        frequency = coarse + correction
        burst = x[begin:]
        # 3. Channel, 4. offset again, and with it the channel.
        y = to_subcarriers(burst, self._windows, frequency, dc, grid)
        channel = self._of_training(y, always)
        frequency += refine(turned_back(burst, dc, frequency), channel.h, grid)
        y = to_subcarriers(burst, self._windows, frequency, dc, grid)
        channel = self._of_training(y, always)
        # 5. Header.
        clock_error = frequency / self._centre_cycles if self._centre_cycles else None
        equaliser = Equaliser(grid, channel, Tracking(grid, channel, clock_error))
        llr, points = self._read(y[preamble.N_LONG :], equaliser, always, whole)
        header = parse_header(folded(llr))
        if header is None:
            return Missed("header")
        sent = header_subcarriers(header, grid)
        whole = None if cuts is None else cuts.whole(base + begin + self._windows, grid)
        self._learn(y, sent, equaliser, always, whole)
        training = burst[self._windows[0] :][: preamble.N_LONG * grid.n_fft]
        quality = BurstQuality(
            base + begin + BACKOFF,
            *header,
            snr_db=_snr_db(equaliser.channel, grid),
            rssi_dbfs=decibel(float(np.mean(np.abs(training - dc) ** 2))),
            evm_db=_evm_db(points, sent[:, grid.data_at], always[grid.data_at]),
            cfo=frequency,
        )
        origin = base + begin
        window = origin + int(self._windows[-1]) + grid.n_symbol
        return Acquired(header, quality, origin, window, frequency, equaliser)

    def _of_training(self, y: Subcarriers, kept: NDArray[np.float32]) -> Channel:
        """Estimate the channel from both long symbols."""
        n = preamble.N_LONG
        return estimate(y[:n], self._long, np.ones(n), self._grid, kept)

    def _read(
        self,
        y: Subcarriers,
        equaliser: Equaliser,
        kept: NDArray[np.float32],
        whole: NDArray[np.float32] | None,
    ) -> tuple[NDArray[np.int16], NDArray[np.complex128]]:
        """Convert header symbols `[n, n_used]` to (LLRs `[n · n_data]`, points `[n, n_data]`)."""
        return equaliser.equalise(y, 0, Modulation.BPSK, np.tile(kept, (len(y), 1)), whole)

    def _learn(
        self,
        y: Subcarriers,
        sent: Subcarriers,
        equaliser: Equaliser,
        kept: NDArray[np.float32],
        whole: NDArray[np.float32] | None,
    ) -> None:
        """Refine the channel with the decoded header: four symbols instead of two.

        The header's symbols have turned by the tracked phase, minus the rate for each later symbol.
        """
        tracked = equaliser.tracking.phase
        later = np.arange(len(sent), dtype=np.float64)[::-1]
        rotation = np.asarray(tracked.value - tracked.rate * later, np.float64)
        known = np.concatenate((self._long, sent))
        equaliser.channel = learn(
            y, known, preamble.N_LONG, rotation, equaliser.channel, self._grid, kept, whole
        )


def header_subcarriers(header: BurstHeader, grid: Numerology) -> Subcarriers:
    """The subcarriers of a header as sent `[n, n_used]`, with the effect of clipped peaks."""
    samples: Samples = header_samples(header, grid)
    starts = grid.n_cp + grid.n_symbol * np.arange(n_symbols(grid))
    return to_subcarriers(samples, starts, 0.0, 0j, grid)


def _snr_db(channel: Channel, grid: Numerology) -> float:
    """The SNR in dB; noise counts in all 64 subcarriers, the signal in 52."""
    return decibel(channel.gain / channel.no * grid.n_used / grid.n_fft)


def _evm_db(points: Subcarriers, sent: Subcarriers, kept: NDArray[np.float32]) -> float:
    """The error of points `[n, n_data]` in dB, without what was cut."""
    return decibel(float(np.sum(kept * np.abs(points - sent) ** 2) / points.size))


def decibel(ratio: float) -> float:
    """Convert a power ratio to dB, rounded to three places."""
    return math.floor(1e4 * math.log10(max(ratio, 1e-30)) + 0.5) / 1e3
