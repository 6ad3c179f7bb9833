"""From a detector's peak to LLRs of the header, and from a known header to a better channel.

Samples lie in two rows, real and imaginary parts, so that loops are vectorised.

1. The detector's peak gives the frequency modulo 1/16 cycles per sample.
2. The long training is correlated for every multiple of 1/16 within reach: the best match gives the
   frequency, and the first strong echo the timing.
3. The phase from each 64 samples of the long training to the next refines the frequency.
4. The whole preamble, rebuilt from a first channel estimate, gives the most likely frequency.
"""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from phy.kernels.equaliser import equalise, renew, start_tracking
from phy.kernels.fft import windows_to_tones
from phy.kernels.inline import step
from phy.kernels.lanes import Lanes, load, splat, store, total
from phy.kernels.local import local
from phy.kernels.openers import (
    open_axes,
    open_channel,
    open_room,
    open_scratch,
    open_tones,
    open_training,
)
from phy.kernels.timing import locate
from phy.kernels.training import estimate, learn, turn_back
from phy.kernels.viterbi import decode_block
from phy.sizes import MAX_LLR, N_LANES
from phy.tables.acquisition import (
    BACKOFF,
    FIRST_CLEAN,
    N_LONG,
    PART,
    SEARCH,
    SEGMENT,
    Room,
    Training,
)
from phy.tables.block import PackedArguments
from phy.tables.burst import GAIN, NO, PHASE, Planes

# A literal would make numba compile the callee once more, for this value.
_0: Any = np.int64(0)


@njit(nogil=True, cache=True, error_model="numpy")
def refine(training: Training, h: Planes, room: Room) -> float:
    """The most likely frequency correction from the whole preamble, in cycles per sample.

    `room.planes` begin BACKOFF samples before the preamble.
    """
    _make_wave(training.waves, h, room.wave)
    n_segments, begin = training.cover.size, training.windows[0]
    n_parts, n_fft = training.turns.shape[0], training.templates.shape[1]
    for s in range(n_segments):
        _agree(room, SEGMENT * s + FIRST_CLEAN, _0, training.cover[s], s)
    for part in range(n_parts - n_segments):
        at = part * PART
        _agree(room, begin + at, SEGMENT + at % n_fft, np.float32(1), n_segments + part)
    n = training.frequencies.size
    likely = local(np.float64, n)
    for i in range(n):
        re = im = np.float32(0)
        for part in range(n_parts):
            a, b = room.parts[0, part], room.parts[1, part]
            c, d = training.turns[part, 0, i], training.turns[part, 1, i]
            re += a * c - b * d
            im += a * d + b * c
        likely[i] = re * re + im * im
    return _peak_of_parabola(training.frequencies, likely)


@njit(nogil=True, cache=True, error_model="numpy")
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


@njit(nogil=True, cache=True, error_model="numpy")
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


@njit(nogil=True, cache=True, error_model="numpy")
def _peak_of_parabola(places: NDArray[np.float64], values: NDArray[np.float64]) -> float:
    """Position of the peak of the parabola through the largest value and its neighbors."""
    i = int(min(max(int(values.argmax()), 1), values.size - 2))
    left, middle, right = values[i - 1], values[i], values[i + 1]
    bend = left - 2 * middle + right
    shift = 0.5 * (left - right) / bend if bend < 0 else 0.0
    return float(places[i] + min(max(shift, -1.0), 1.0) * (places[1] - places[0]))


@njit(nogil=True, cache=True, error_model="numpy")
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
    amplitude = local(np.float32, N_LONG)
    amplitude[:] = 1
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


@njit(nogil=True, cache=True, error_model="numpy")
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
            if channel.kept[s, d] == 0:
                continue
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


@njit(nogil=True, cache=True, error_model="numpy")
def fold(llr: NDArray[np.int16], out: NDArray[np.int16]) -> None:
    """Add up the LLRs of each bit's repetitions, clipped to ±MAX_LLR."""
    for i in range(out.size):
        total = 0
        for k in range(i, llr.size, out.size):
            total += llr[k]
        out[i] = min(max(total, -MAX_LLR), MAX_LLR)
