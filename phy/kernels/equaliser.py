"""Carriers to LLRs: follow phase, timing and channel, equalise, demap, de-interleave."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from phy.kernels.burst import (
    CERTAIN,
    DELAY,
    DRIFT,
    GAIN,
    N_HEARD,
    NO,
    SLOPE_USED,
    Axes,
    Channel,
    Planes,
    Row,
    Tones,
)
from phy.kernels.decisions import expected_level
from phy.kernels.demapper import LLR_SCALE, axis_llrs
from phy.kernels.lanes import N_LANES, load, splat, store, store_int16, total
from phy.kernels.rotation import lean
from phy.kernels.smoothing import follow
from phy.kernels.tracking import PHASE, SLOPE, correct, predict

BLOCK = 8
"""Symbols from one correction of the channel to the next."""
_LEAST_MASS = BLOCK / 4
"""Of what must have been certain in a block, or it teaches nothing: others were on the air."""
# However strong a signal, echoes and converters leave so much on a carrier.
_LEAST_NOISE = 1e-4
# Frequency error of the preamble's estimate, in carrier spacings: at 0 dB, and at best.
_FREQUENCY_ERROR_0_DB = 0.006
_FREQUENCY_ERROR_MIN = 0.0005
# Sampling clocks differ by so much, and by so much if the carrier tells it (standard deviations).
_CLOCK_ERROR, _CLOCK_DOUBT = 40e-6, 5e-6
# Radians by which the outermost carriers may lag the slope before their turn is made anew.
_LAG = 0.01


@njit(nogil=True, cache=True)
def _noise(channel: Channel) -> float:
    return float(max(channel.figures[NO], _LEAST_NOISE * channel.figures[GAIN]))


@njit(nogil=True, cache=True)
def start_tracking(
    channel: Channel, symbol_length: float, clock_error: float, is_known: bool
) -> None:
    """Phase and slope as they stand after the preamble; `symbol_length` in units of the FFT.

    `clock_error` is the share by which the sender's sampling clock is fast, as far as it is known;
    pilots may contradict it.
    """
    figures, tracking = channel.figures, channel.tracking
    error = _FREQUENCY_ERROR_0_DB * math.sqrt(figures[NO] / figures[GAIN])
    turn = 2 * math.pi * symbol_length
    tracking[:] = 0
    tracking[PHASE, 4] = (turn * max(error, _FREQUENCY_ERROR_MIN)) ** 2
    tracking[SLOPE, 1] = turn * clock_error
    tracking[SLOPE, 4] = (turn * (_CLOCK_DOUBT if is_known else _CLOCK_ERROR)) ** 2
    channel.sums[:] = 0
    channel.masses[:] = 0
    figures[DRIFT] = figures[N_HEARD] = figures[CERTAIN] = figures[SLOPE_USED] = 0


@njit(nogil=True, cache=True, error_model="numpy")
def _renew(
    channel: Channel, tones: Tones, unit: float, turns: Planes, inverse: Planes, weight: Row
) -> None:
    """What equalising needs, for the channel as it is and the slope that is used."""
    turn = np.empty(tones.bins.size, np.complex64)
    lean(-channel.figures[SLOPE_USED], tones.carriers, turn)
    for k in range(turn.size):
        turns[0, k], turns[1, k] = turn[k].real, turn[k].imag
    certainty = np.float32(LLR_SCALE * unit * unit / _noise(channel))
    per_unit = np.float32(1 / unit)
    for d in range(tones.n_data):
        h = channel.h_hat[d]
        power = h.real * h.real + h.imag * h.imag
        weight[d] = certainty * power
        share = per_unit / power if power > 0 else np.float32(0)
        inverse[0, d], inverse[1, d] = h.real * share, -h.imag * share


@njit(nogil=True, cache=True)
def _pilots(
    re: Row,
    im: Row,
    channel: Channel,
    tones: Tones,
    turns: Planes,
    polarity: float,
    turned: NDArray[np.complex128],
    power: NDArray[np.float64],
) -> float:
    """Follow phase and slope to this symbol; its noise power on a carrier."""
    tracking = channel.tracking
    predict(tracking)
    angle = -tracking[PHASE, 0]
    back = complex(math.cos(angle), math.sin(angle))
    behind = channel.figures[SLOPE_USED] - tracking[SLOPE, 0]
    for p in range(tones.pilots.size):
        at = tones.n_data + p
        h = complex(channel.h_hat[at])
        late = behind * tones.carriers[at]
        expected = h.conjugate() * complex(turns[0, at], turns[1, at]) * complex(1.0, late)
        sign = tones.pilots[p] * polarity
        turned[p] = complex(re[at], im[at]) * expected * back * sign
        power[p] = h.real * h.real + h.imag * h.imag
    carriers = tones.carriers[tones.n_data :]
    return correct(turned, power, carriers, _noise(channel), tracking)


@njit(nogil=True, cache=True)
def _learn_pilots(
    re: Row,
    im: Row,
    phase: float,
    trust: float,
    tones: Tones,
    turns: Planes,
    polarity: float,
    sums: Planes,
    masses: Row,
) -> None:
    """What the pilots say of their carriers' gains."""
    back = complex(math.cos(phase), -math.sin(phase))
    for p in range(tones.pilots.size):
        at = tones.n_data + p
        z = complex(re[at], im[at]) * back * complex(turns[0, at], turns[1, at])
        sign = tones.pilots[p] * polarity * trust
        sums[0, at] += z.real * sign
        sums[1, at] += z.imag * sign
        masses[at] += trust


@njit(nogil=True, cache=True)
def _correct_channel(channel: Channel, tones: Tones) -> None:
    """Correct the gains by what the last symbols, as decided, say of them.

    A step of expectation and maximisation, made as long as what was uncertain makes it too short.
    """
    figures, n = channel.figures, channel.h_hat.size
    mass = figures[CERTAIN] / n
    if mass > _LEAST_MASS:
        share = np.float32(1 / mass)
        error, correction = np.empty(n, np.complex64), np.empty(n, np.complex64)
        for k in range(n):
            seen = np.complex64(complex(channel.sums[0, k], channel.sums[1, k]))
            error[k] = (seen - channel.h_hat[k] * channel.masses[k]) * share
        figures[DRIFT] = follow(
            error, _noise(channel) / mass, figures[DELAY], figures[DRIFT], tones.carriers,
            tones.basis, tones.ends, channel.power, channel.unknown, correction,
        )  # fmt: skip
        for k in range(n):
            channel.h_hat[k] += correction[k]
    channel.sums[:] = 0
    channel.masses[:] = 0
    figures[N_HEARD] = figures[CERTAIN] = 0


@njit(nogil=True, cache=True)
def _data(
    re: Row,
    im: Row,
    phase: float,
    trust: float,
    turns: Planes,
    inverse: Planes,
    weight: Row,
    unit: float,
    real_bits: int,
    imag_bits: int,
    llr: Row,
    planes: NDArray[np.int16],
    level: Planes,
    sums: Planes,
    masses: Row,
) -> float:
    """The data carriers of a symbol: `level` and LLRs bit by bit, `llr` and `planes` `[bits · n]`.

    Turned by `phase` and `turns`, they and what they probably are go to `sums` and `masses`, times
    `trust`. What is certain of them is returned.
    """
    n, n_used = weight.size, masses.size
    c, s = splat(math.cos(phase)), splat(-math.sin(phase))
    trusted, by = splat(trust), splat(unit * trust)
    per_mass = splat(unit * unit * trust)
    certain, none = splat(0), splat(0)
    imag_at = real_bits * n
    for d in range(0, n, N_LANES):
        a, b = load(re, d), load(im, d)
        a, b = a * c - b * s, a * s + b * c
        turn_re, turn_im = load(turns, d), load(turns, n_used + d)
        a, b = a * turn_re - b * turn_im, a * turn_im + b * turn_re
        by_re, by_im = load(inverse, d), load(inverse, n + d)
        level_re, level_im = a * by_re - b * by_im, a * by_im + b * by_re
        store(level, d, level_re)
        store(level, n + d, level_im)
        sure = load(weight, d) * trusted
        axis_llrs(level_re, sure, real_bits, llr, d, n)
        mean_re, square = expected_level(llr, real_bits, d, n)
        mean_im = none
        if imag_bits:
            axis_llrs(level_im, sure, imag_bits, llr, imag_at + d, n)
            mean_im, square_im = expected_level(llr, imag_bits, imag_at + d, n)
            square = square + square_im
        store(sums, d, load(sums, d) + (a * mean_re + b * mean_im) * by)
        store(sums, n_used + d, load(sums, n_used + d) + (b * mean_re - a * mean_im) * by)
        store(masses, d, load(masses, d) + square * per_mass)
        certain = certain + (mean_re * mean_re + mean_im * mean_im)
    for i in range(0, planes.size, N_LANES):
        store_int16(planes, i, load(llr, i))
    return float(total(certain)) * unit * unit * trust


@njit(nogil=True, cache=True)
def demap(
    y: NDArray[np.float32],
    polarity: NDArray[np.float32],
    tones: Tones,
    axes: Axes,
    channel: Channel,
    points: NDArray[np.complex64],
    llr: NDArray[np.int16],
) -> None:
    """Symbols to LLRs `[n · n_data · bits]` in the code's order, positive for 0.

    `y` `[n, 2, ≥ n_used]`: real and imaginary parts, in the order of tones. `channel` goes on from
    call to call. `points` `[n, n_data]` gets the equalised points, if it has any rows.
    """
    n_data, n_used, n_bits = tones.n_data, tones.bins.size, axes.gather.size
    gather, unit = axes.gather, axes.unit
    turns, inverse = np.empty((2, n_used), np.float32), np.empty((2, n_data), np.float32)
    level, weight = np.empty((2, n_data), np.float32), np.empty(n_data, np.float32)
    certainty, planes = np.empty(n_bits, np.float32), np.empty(n_bits, np.int16)
    turned, power = np.empty(n_used - n_data, np.complex128), np.empty(n_used - n_data)
    sums, masses, figures = channel.sums, channel.masses, channel.figures
    most_lag = _LAG / np.abs(tones.carriers).max()
    _renew(channel, tones, unit, turns, inverse, weight)
    for row in range(y.shape[0]):
        re, im = y[row, 0], y[row, 1]
        no = _pilots(re, im, channel, tones, turns, polarity[row], turned, power)
        if abs(channel.tracking[SLOPE, 0] - figures[SLOPE_USED]) > most_lag:
            figures[SLOPE_USED] = channel.tracking[SLOPE, 0]
            _renew(channel, tones, unit, turns, inverse, weight)
        phase, trust = channel.tracking[PHASE, 0], _noise(channel) / no
        certain = _data(
            re, im, phase, trust, turns, inverse, weight, unit, axes.real_bits, axes.imag_bits,
            certainty, planes, level, sums, masses,
        )  # fmt: skip
        if points.shape[0]:
            for d in range(n_data):
                points[row, d] = complex(level[0, d] * unit, level[1, d] * unit)
        first = row * n_bits
        for k in range(n_bits):
            llr[first + k] = planes[gather[k]]
        _learn_pilots(re, im, phase, trust, tones, turns, polarity[row], sums, masses)
        figures[CERTAIN] += certain + (n_used - n_data) * trust
        figures[N_HEARD] += 1
        if figures[N_HEARD] == BLOCK:
            _correct_channel(channel, tones)
            _renew(channel, tones, unit, turns, inverse, weight)
