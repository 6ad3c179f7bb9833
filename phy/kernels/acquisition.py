"""From a detector's peak to LLRs of the header, and from a known header to a better channel.

Samples lie in two rows, real and imaginary parts, so that loops are vectorised.

1. The detector's peak tells the frequency modulo 1/16 cycles a sample.
2. The long training is correlated for every multiple of 1/16 within reach: the best tells the
   frequency, and the first strong echo the timing.
3. The phase from each 64 samples of it to the next.
4. All of the preamble, re-made from a first channel estimate: the most likely frequency.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from phy.kernels.burst import Axes, Channel, Planes, Tones
from phy.kernels.equaliser import demap, start_tracking
from phy.kernels.fft import to_tones
from phy.kernels.training import estimate, turn_back, wave
from phy.kernels.viterbi import MAX_LLR, decode_block

SEARCH = 24
"""The first long symbol is looked for this many samples around where the peak puts it."""
BACKOFF = 3
"""FFT windows begin so many samples before the first echo."""
MIN_MATCH = 0.12
FIRST_ECHO = 0.1
MAX_SPREAD = 12
AMBIGUITY = 1 / 16
_COHERENT = 64
_LAG = 64
_SEGMENT = 16
# Samples of a short segment that echoes of the one before hardly reach.
FIRST_CLEAN = BACKOFF + 4
N_CLEAN = _SEGMENT - 4
PART = 16
"""Samples of the long training whose phase is looked at as one."""


class Training(NamedTuple):
    """What acquisition knows of a preamble and a header on one grid."""

    templates: NDArray[np.complex64]
    """The long symbol, shifted by each multiple of 1/16 that is tried `[2 aliases + 1, n_fft]`."""
    gain: float
    """What carriers of samples of mean power 1 are taken times."""
    long_tones: NDArray[np.complex64]
    """The long training as sent, in the order of tones `[2, n_used]`."""
    short_wave: NDArray[np.complex64]
    """Gains to a short segment in time `[16, n_used]`."""
    long_wave: NDArray[np.complex64]
    """Gains to a long symbol in time `[n_fft, n_used]`."""
    cover: NDArray[np.float32]
    frequencies: NDArray[np.float64]
    """Corrections of the frequency that are tried, in cycles a sample, evenly spaced."""
    turns: NDArray[np.complex64]
    """The preamble's parts turned back by each of them `[n_frequencies, n_parts]`."""
    windows: NDArray[np.int64]
    """First samples of the FFT windows of the long training and the header."""
    polarity: NDArray[np.float32]
    """Of the header's pilots `[n_header]`."""
    n_symbol: int


@njit(nogil=True, cache=True)
def correlate(planes: Planes, templates: NDArray[np.complex64], out: NDArray[np.float32]) -> None:
    """Strength of two templates in a row at each offset of `planes` `[2, n]`.

    With c[o] = Σ_m z[o + m] t*[a, m], out[a, o] = |c[o] + c[o + n]|²; for templates so long that
    the frequency is not known well enough to add them up, 2 |c[o]|² + 2 |c[o + n]|². `templates`
    are `[aliases, n]`.
    """
    re, im = planes[0], planes[1]
    n_template, n_out = templates.shape[1], out.shape[1]
    n = n_out + n_template
    for a in range(templates.shape[0]):
        c_re, c_im = np.zeros(n, np.float32), np.zeros(n, np.float32)
        for m in range(n_template):
            t_re, t_im = templates[a, m].real, templates[a, m].imag
            x_re, x_im = re[m : m + n], im[m : m + n]
            for o in range(n):
                c_re[o] += x_re[o] * t_re + x_im[o] * t_im
                c_im[o] += x_im[o] * t_re - x_re[o] * t_im
        second_re, second_im = c_re[n_template:], c_im[n_template:]
        for o in range(n_out):
            re_sum, im_sum = c_re[o] + second_re[o], c_im[o] + second_im[o]
            out[a, o] = re_sum * re_sum + im_sum * im_sum
        if n_template > _COHERENT:
            for o in range(n_out):
                re_rest, im_rest = c_re[o] - second_re[o], c_im[o] - second_im[o]
                out[a, o] += re_rest * re_rest + im_rest * im_rest


@njit(nogil=True, cache=True)
def locate(planes: Planes, templates: NDArray[np.complex64]) -> tuple[int, float]:
    """(first sample of the long training's first echo or −1, frequency in cycles a sample).

    It is looked for at the first 2 SEARCH samples of `planes` `[2, 2 SEARCH + 2 n_fft]`.
    """
    n_aliases, n = templates.shape
    strength = np.empty((n_aliases, 2 * SEARCH), np.float32)
    correlate(planes, templates, strength)
    alias, peak, most = 0, 0, np.float32(-1)
    for a in range(n_aliases):
        for o in range(2 * SEARCH):
            if strength[a, o] > most:
                alias, peak, most = a, o, strength[a, o]
    re, im = planes[0, peak:], planes[1, peak:]
    power = np.float32(0)
    for m in range(2 * n):
        power += re[m] * re[m] + im[m] * im[m]
    if not most > MIN_MATCH * 2 * n * power:
        return -1, 0.0
    early = max(0, peak - MAX_SPREAD)
    while strength[alias, early] < FIRST_ECHO * most:
        early += 1
    turn, before = 0j, 0j
    for begin in range(0, 2 * n, _LAG):
        total = 0j
        for m in range(begin, begin + _LAG):
            total += complex(re[m], im[m]) * complex(templates[alias, m % n]).conjugate()
        turn += total * before.conjugate()
        before = total
    rest = math.atan2(turn.imag, turn.real) / (2 * math.pi * _LAG)
    return early, (alias - n_aliases // 2) * AMBIGUITY + rest


@njit(nogil=True, cache=True)
def refine(planes: Planes, training: Training, h_hat: NDArray[np.complex64]) -> float:
    """The most likely correction of the frequency, over all of the preamble, cycles a sample.

    `planes` begin BACKOFF samples before the preamble.
    """
    re, im = planes[0], planes[1]
    n_fft, n_segments = training.templates.shape[1], training.cover.size
    short, long = np.empty(_SEGMENT, np.complex64), np.empty(n_fft, np.complex64)
    wave(training.short_wave, h_hat, short)
    wave(training.long_wave, h_hat, long)
    n_parts = training.turns.shape[1]
    parts = np.empty(n_parts, np.complex64)
    for s in range(n_segments):
        total = np.complex64(0)
        for m in range(FIRST_CLEAN, FIRST_CLEAN + N_CLEAN):
            at = _SEGMENT * s + m
            total += np.complex64(complex(re[at], im[at])) * np.conj(short[m % _SEGMENT])
        parts[s] = total * training.cover[s]
    begin = training.windows[0]
    for part in range(n_parts - n_segments):
        total = np.complex64(0)
        for m in range(part * PART, (part + 1) * PART):
            at = begin + m
            total += np.complex64(complex(re[at], im[at])) * np.conj(long[m % n_fft])
        parts[n_segments + part] = total
    likely = np.empty(training.frequencies.size)
    for i in range(likely.size):
        total = np.complex64(0)
        for part in range(n_parts):
            total += training.turns[i, part] * parts[part]
        likely[i] = total.real * total.real + total.imag * total.imag
    return _peak_of_parabola(training.frequencies, likely)


@njit(nogil=True, cache=True)
def _peak_of_parabola(places: NDArray[np.float64], values: NDArray[np.float64]) -> float:
    """Where the parabola through the largest value and its neighbours has its peak."""
    i = int(min(max(int(values.argmax()), 1), values.size - 2))
    left, middle, right = values[i - 1], values[i], values[i + 1]
    bend = left - 2 * middle + right
    shift = 0.5 * (left - right) / bend if bend < 0 else 0.0
    return float(places[i] + min(max(shift, -1.0), 1.0) * (places[1] - places[0]))


class Room(NamedTuple):
    """What acquisition needs besides its input, and leaves: one for each thread."""

    planes: Planes
    """The burst's samples up to the end of its header, turned back."""
    y: NDArray[np.float32]
    """Long training and header `[2 + n_header, 2, ≥ n_used]`, in the order of tones."""
    points: NDArray[np.complex64]
    """Of the header `[n_header, n_data]`."""
    llr: NDArray[np.int16]
    """Of the header's coded bits, as often as they were repeated `[n_header · n_data]`."""
    folded: NDArray[np.int16]
    """The same, of each bit once `[2 (32 + 6)]`."""
    decisions: NDArray[np.uint64]
    octets: NDArray[np.uint8]
    """The likeliest header, with its check `[4]`."""


@njit(nogil=True, cache=True)
def acquire(
    x: NDArray[np.complex64],
    nominal: int,
    coarse: float,
    dc: complex,
    carrier_cycles: float,
    training: Training,
    tones: Tones,
    axes: Axes,
    channel: Channel,
    room: Room,
) -> tuple[int, float]:
    """(first sample of the burst or −1, its frequency) of the burst in `x`; its header to `room`.

    The first long symbol is nominally at `nominal`; `coarse` is the frequency modulo 1/16, and
    `carrier_cycles` those of the carrier in a sample, if one crystal makes both, or 0.
    """
    n_fft, planes, y = training.templates.shape[1], room.planes, room.y
    first = nominal - SEARCH
    span = 2 * SEARCH + 2 * n_fft
    turn_back(x[first : first + span], dc, coarse, planes)
    early, correction = locate(planes[:, :span], training.templates)
    if early < 0:
        return -1, 0.0
    begin = first + early - training.windows[0] - BACKOFF
    n = training.windows[-1] + n_fft
    frequency = coarse + correction
    turn_back(x[begin : begin + n], dc, frequency, planes)
    burst, windows, gain = x[begin : begin + n], training.windows, training.gain
    to_tones(burst, windows[:2], frequency, 0, dc, gain, n_fft, tones.bins, y[:2])
    amplitude = np.ones(2, np.float32)
    estimate(y[:2], amplitude, training.long_tones, tones, channel)
    frequency += refine(planes, training, channel.h_hat)
    to_tones(burst, windows, frequency, 0, dc, gain, n_fft, tones.bins, y)
    estimate(y[:2], amplitude, training.long_tones, tones, channel)
    clock_error = frequency / carrier_cycles if carrier_cycles else 0.0
    start_tracking(channel, training.n_symbol / n_fft, clock_error, carrier_cycles > 0)
    demap(y[2:], training.polarity, tones, axes, channel, room.points, room.llr)
    fold(room.llr, room.folded)
    decode_block(room.folded, room.decisions, room.octets)
    return begin + BACKOFF, frequency


@njit(nogil=True, cache=True)
def fold(llr: NDArray[np.int16], out: NDArray[np.int16]) -> None:
    """Add up what each bit's repetitions say."""
    for i in range(out.size):
        total = 0
        for k in range(i, llr.size, out.size):
            total += llr[k]
        out[i] = min(max(total, -MAX_LLR), MAX_LLR)
