"""From a detector's peak to LLRs of the header, and from a known header to a better channel.

Samples lie in two rows, real and imaginary parts, so that loops are vectorised.

1. The detector's peak gives the frequency modulo 1/16 cycles per sample.
2. The long training is correlated for every multiple of 1/16 within reach: the best match gives the
   frequency, and the first strong echo the timing.
3. The phase from each 64 samples of the long training to the next refines the frequency.
4. The whole preamble, rebuilt from a first channel estimate, gives the most likely frequency.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from phy.kernels.argument_block import PackedArguments, opener
from phy.kernels.burst import (
    GAIN,
    NO,
    Planes,
    Row,
    open_axes,
    open_channel,
    open_scratch,
    open_tones,
)
from phy.kernels.equaliser import equalise, renew, start_tracking
from phy.kernels.fft import windows_to_tones
from phy.kernels.inline import step
from phy.kernels.lanes import N_LANES, Lanes, load, splat, store, total
from phy.kernels.timing import SEARCH, locate
from phy.kernels.tracking import PHASE
from phy.kernels.training import estimate, learn, turn_back
from phy.kernels.viterbi import MAX_LLR, decode_block

# A literal would make numba compile the callee once more, for this value.
_0: Any = np.int64(0)

BACKOFF = 3
"""Number of samples before the first echo at which FFT windows begin."""
_SEGMENT = 16
# First samples of a short segment that echoes of the previous segment hardly reach.
FIRST_CLEAN = BACKOFF + 4
N_CLEAN = _SEGMENT - 4
PART = 16
"""Number of samples of the long training whose phase is evaluated together."""
N_LONG = 2
"""Number of symbols in the long training."""


class Training(NamedTuple):
    """Tables about the preamble and the header on one grid, for acquisition."""

    templates: NDArray[np.complex64]
    """The long symbol, shifted by each multiple of 1/16 to try `[2 aliases + 1, n_fft]`."""
    long: NDArray[np.float32]
    """The long training as sent `[2, 2, width]`."""
    waves: NDArray[np.float32]
    """Each tone of the preamble in time, `[n_used, 2, 16 + n_fft]`.

    A row holds the clean samples of a short segment, then zeros, then the long symbol.
    """
    cover: Row
    frequencies: NDArray[np.float64]
    """Frequency corrections to try, in cycles per sample, evenly spaced."""
    turns: NDArray[np.float32]
    """Factors that rotate each preamble part back by `frequencies`.

    The shape is `[n_parts, 2, n_frequencies]`.
    """
    windows: NDArray[np.int64]
    """First samples of the FFT windows of the long training and the header."""


open_training = opener(Training, "c8[2] f4[3] f4[3] f4[1] f8[1] f4[3] i8[1]")


class Room(NamedTuple):
    """Working memory and results of acquisition; one per thread."""

    planes: Planes
    """The burst's samples up to the end of its header, rotated back."""
    wave: Planes
    """The preamble after the channel, laid out like a row of `Training.waves`."""
    parts: Planes
    """Correlation of the preamble's parts with `wave` `[2, n_parts]`."""
    y: NDArray[np.float32]
    """Long training and header `[2 + n_header, 2, width]`."""
    points: NDArray[np.complex64]
    """The header's equalised points `[n_header, n_data]`."""
    llr: NDArray[np.int16]
    """LLRs of the header's coded bits, including repetitions `[n_header · n_data]`."""
    folded: NDArray[np.int16]
    """LLRs of the header's coded bits, with repetitions added up `[2 (32 + 6)]`."""
    decisions: NDArray[np.uint64]
    octets: NDArray[np.uint8]
    """The likeliest header, with its check sum `[4]`."""


open_room = opener(Room, "f4[2] f4[2] f4[2] f4[3] c8[2] i2[1] i2[1] u8[1] u1[1]")


@njit(nogil=True, cache=True)
def refine(training: Training, h: Planes, room: Room) -> float:
    """The most likely frequency correction from the whole preamble, in cycles per sample.

    `room.planes` begin BACKOFF samples before the preamble.
    """
    _make_wave(training.waves, h, room.wave)
    n_segments, begin = training.cover.size, training.windows[0]
    n_parts, n_fft = training.turns.shape[0], training.templates.shape[1]
    for s in range(n_segments):
        _agree(room, _SEGMENT * s + FIRST_CLEAN, _0, training.cover[s], s)
    for part in range(n_parts - n_segments):
        at = part * PART
        _agree(room, begin + at, _SEGMENT + at % n_fft, np.float32(1), n_segments + part)
    n = training.frequencies.size
    likely = np.empty(n)
    for i in range(n):
        re = im = np.float32(0)
        for part in range(n_parts):
            a, b = room.parts[0, part], room.parts[1, part]
            c, d = training.turns[part, 0, i], training.turns[part, 1, i]
            re += a * c - b * d
            im += a * d + b * c
        likely[i] = re * re + im * im
    return _peak_of_parabola(training.frequencies, likely)


@njit(nogil=True, cache=True)
def _make_wave(waves: NDArray[np.float32], h: Planes, out: Planes) -> None:
    """Write the sum of `waves` `[n_used, 2, n]`, each times its gain in `h`, to `out`."""
    n = waves.shape[2]
    for m in range(0, n, N_LANES):
        re: Lanes = splat(0)
        im: Lanes = splat(0)
        for k in range(waves.shape[0]):
            at = 2 * n * k + m
            a, b = load(waves, at), load(waves, at + n)
            c, d = splat(h[0, k]), splat(h[1, k])
            re = re + (a * c - b * d)
            im = im + (a * d + b * c)
        store(out, m, re)
        store(out, n + m, im)


@njit(nogil=True, cache=True)
def _agree(room: Room, at: int, wave_at: int, sign: np.float32, part: int) -> None:
    """Write Σ z w* over PART samples, from `at` and `wave_at` on, times `sign`, to part `part`."""
    z, w = room.planes, room.wave
    size, wave_size = z.shape[1], w.shape[1]
    re: Lanes = splat(0)
    im: Lanes = splat(0)
    for m in range(0, PART, N_LANES):
        a, b = load(z, at + m), load(z, size + at + m)
        c, d = load(w, wave_at + m), load(w, wave_size + wave_at + m)
        re = re + (a * c + b * d)
        im = im + (b * c - a * d)
    room.parts[0, part], room.parts[1, part] = total(re) * sign, total(im) * sign


@njit(nogil=True, cache=True)
def _peak_of_parabola(places: NDArray[np.float64], values: NDArray[np.float64]) -> float:
    """Position of the peak of the parabola through the largest value and its neighbors."""
    i = int(min(max(int(values.argmax()), 1), values.size - 2))
    left, middle, right = values[i - 1], values[i], values[i + 1]
    bend = left - 2 * middle + right
    shift = 0.5 * (left - right) / bend if bend < 0 else 0.0
    return float(places[i] + min(max(shift, -1.0), 1.0) * (places[1] - places[0]))


@njit(nogil=True, cache=True)
def acquire(
    x: NDArray[np.complex64],
    nominal: int,
    coarse: float,
    dc: complex,
    centre_cycles: float,
    training_in: PackedArguments,
    tones_in: PackedArguments,
    axes_in: PackedArguments,
    channel_in: PackedArguments,
    scratch_in: PackedArguments,
    room_in: PackedArguments,
) -> tuple[int, float]:
    """Acquire the burst in `x`; returns (its first sample or −1, its frequency).

    The header is written to the room. The first long symbol is nominally at `nominal`. `coarse` is
    the frequency in cycles per sample, modulo 1/16. `centre_cycles` is the centre frequency in
    cycles per sample if one crystal makes both, or 0.
    """
    training, tones, axes = open_training(training_in), open_tones(tones_in), open_axes(axes_in)
    channel, scratch, room = open_channel(channel_in), open_scratch(scratch_in), open_room(room_in)
    planes, y, windows = room.planes, room.y, training.windows
    first = nominal - SEARCH
    span = 2 * SEARCH + 2 * tones.n_fft
    turn_back(x[first : first + span], dc, coarse, planes)
    early, correction = locate(planes, training.templates)
    if early < 0:
        return -1, 0.0
    begin = first + early - windows[0] - BACKOFF
    frequency = coarse + correction
    burst = x[begin : begin + windows[-1] + tones.n_fft]
    turn_back(burst[: windows[1] + tones.n_fft], dc, frequency, planes)
    amplitude = np.ones(2, np.float32)
    windows_to_tones(burst, windows[:2], frequency, dc, _0, tones, scratch, y)
    estimate(y, amplitude, training.long, tones, channel, scratch)
    frequency += refine(training, channel.h, room)
    windows_to_tones(burst, windows, frequency, dc, _0, tones, scratch, y)
    estimate(y, amplitude, training.long, tones, channel, scratch)
    clock_error = frequency / centre_cycles if centre_cycles else 0.0
    start_tracking(tones, channel, clock_error, centre_cycles > 0)
    n_header = room.points.shape[0]
    equalise(y[2:], n_header, _0, tones, axes, channel, scratch, room.points, room.llr, _0)
    fold(room.llr, room.folded)
    decode_block(room.folded, room.decisions, room.octets)
    return begin + BACKOFF, frequency


@njit(nogil=True, cache=True)
def settle(
    sent: NDArray[np.float32],
    training_in: PackedArguments,
    tones_in: PackedArguments,
    channel_in: PackedArguments,
    scratch_in: PackedArguments,
    room_in: PackedArguments,
) -> tuple[float, float, float]:
    """Refine the channel with a decoded header; `sent` are long training and header.

    Returns, in dB: SNR over the band, mean power of the long training's samples, error of the
    header's points.
    """
    training, tones, room = open_training(training_in), open_tones(tones_in), open_room(room_in)
    channel, scratch = open_channel(channel_in), open_scratch(scratch_in)
    phase, rate = channel.tracking[PHASE, 0], channel.tracking[PHASE, 1]
    learn(room.y, sent, N_LONG, phase, rate, tones, channel, scratch)
    renew(channel)
    error, n_header = 0.0, room.points.shape[0]
    for s in range(n_header):
        for d in range(tones.n_data):
            x = complex(sent[N_LONG + s, 0, d], sent[N_LONG + s, 1, d])
            off = complex(room.points[s, d]) - 1 / x.conjugate()
            error += off.real * off.real + off.imag * off.imag
    power, first = 0.0, training.windows[0]
    for m in range(first, first + N_LONG * tones.n_fft):
        re, im = float(room.planes[0, m]), float(room.planes[1, m])
        power += re * re + im * im
    figures = channel.figures
    snr = figures[GAIN] / figures[NO] * tones.bins.size / tones.n_fft
    power /= N_LONG * tones.n_fft
    return _decibel(snr), _decibel(power), _decibel(error / (n_header * tones.n_data))


@step
def _decibel(ratio: float) -> float:
    """A power ratio in dB, to three places."""
    return math.floor(1e4 * math.log10(max(ratio, 1e-30)) + 0.5) / 1e3


@njit(nogil=True, cache=True)
def fold(llr: NDArray[np.int16], out: NDArray[np.int16]) -> None:
    """Add up the LLRs of each bit's repetitions, clipped to ±MAX_LLR."""
    for i in range(out.size):
        total = 0
        for k in range(i, llr.size, out.size):
            total += llr[k]
        out[i] = min(max(total, -MAX_LLR), MAX_LLR)
