"""FFT bins to LLRs: follow phase, timing and channel, equalise, demap, de-interleave."""

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
from phy.kernels.decisions import expected_levels
from phy.kernels.demapper import LLR_SCALE, axis_llrs
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
def _multiply(re: Row, im: Row, by_re: Row, by_im: Row, out_re: Row, out_im: Row) -> None:
    for k in range(out_re.size):
        a, b = re[k], im[k]
        out_re[k] = a * by_re[k] - b * by_im[k]
        out_im[k] = a * by_im[k] + b * by_re[k]


@njit(nogil=True, cache=True)
def _turn(re: Row, im: Row, c: np.float32, s: np.float32, out_re: Row, out_im: Row) -> None:
    for k in range(out_re.size):
        a, b = re[k], im[k]
        out_re[k] = a * c - b * s
        out_im[k] = a * s + b * c


@njit(nogil=True, cache=True)
def _learn(re: Row, im: Row, mean: Planes, by: np.float32, sums: Planes) -> None:
    """Add what carriers with points of such a mean say of their gains."""
    mean_re, mean_im, sums_re, sums_im = mean[0], mean[1], sums[0], sums[1]
    for d in range(mean_re.size):
        sums_re[d] += (re[d] * mean_re[d] + im[d] * mean_im[d]) * by
    for d in range(mean_re.size):
        sums_im[d] += (im[d] * mean_re[d] - re[d] * mean_im[d]) * by


@njit(nogil=True, cache=True)
def _add(square: Planes, by: np.float32, masses: Row) -> None:
    re, im = square[0], square[1]
    for d in range(re.size):
        masses[d] += (re[d] + im[d]) * by


# Sums in any order, so that they are vectorised; the order is the same at every call.
@njit(nogil=True, cache=True, fastmath={"reassoc", "contract"})
def _squares(x: Row) -> np.float32:
    total = np.float32(0)
    for d in range(x.size):
        total += x[d] * x[d]
    return total


@njit(nogil=True, cache=True)
def _pilots(
    z: Planes,
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
        turned[p] = complex(z[0, at], z[1, at]) * expected * back * sign
        power[p] = h.real * h.real + h.imag * h.imag
    carriers = tones.carriers[tones.n_data :]
    return correct(turned, power, carriers, _noise(channel), tracking)


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
def demap(
    y: NDArray[np.complex64],
    polarity: NDArray[np.float32],
    tones: Tones,
    axes: Axes,
    channel: Channel,
    points: NDArray[np.complex64],
    llr: NDArray[np.int16],
) -> None:
    """Symbols `y` `[n, n_fft]` to LLRs `[n · n_data · bits]` in the code's order, positive for 0.

    `channel` goes on from call to call. `points` `[n, n_data]` gets the equalised points, if it has
    any rows.
    """
    n_data, n_used = tones.n_data, tones.bins.size
    real_bits, imag_bits = axes.real_bits, axes.imag_bits
    n_bits, unit = axes.gather.size, np.float32(axes.unit)
    turns, z = np.empty((2, n_used), np.float32), np.empty((2, n_used), np.float32)
    half = np.empty((2, n_used), np.float32)
    inverse, level = np.empty((2, n_data), np.float32), np.empty((2, n_data), np.float32)
    usual, weight = np.empty(n_data, np.float32), np.empty(n_data, np.float32)
    mean, square = np.zeros((2, n_data), np.float32), np.zeros((2, n_data), np.float32)
    room, bits = np.empty(n_data, np.float32), np.empty(n_bits, np.int16)
    turned = np.empty(n_used - n_data, np.complex128)
    power = np.empty(n_used - n_data)
    lower = bits[real_bits * n_data :]
    sums, masses, figures = channel.sums, channel.masses, channel.figures
    most_lag = _LAG / np.abs(tones.carriers).max()
    _renew(channel, tones, axes.unit, turns, inverse, usual)
    for row in range(y.shape[0]):
        for k in range(n_used):
            value = y[row, tones.bins[k]]
            z[0, k], z[1, k] = value.real, value.imag
        no = _pilots(z, channel, tones, turns, polarity[row], turned, power)
        if abs(channel.tracking[SLOPE, 0] - figures[SLOPE_USED]) > most_lag:
            figures[SLOPE_USED] = channel.tracking[SLOPE, 0]
            _renew(channel, tones, axes.unit, turns, inverse, usual)
        phase, trust = channel.tracking[PHASE, 0], np.float32(_noise(channel) / no)
        c, s = np.float32(math.cos(phase)), np.float32(-math.sin(phase))
        _turn(z[0], z[1], c, s, half[0], half[1])
        _multiply(half[0], half[1], turns[0], turns[1], z[0], z[1])
        _multiply(z[0], z[1], inverse[0], inverse[1], level[0], level[1])
        if points.shape[0]:
            for d in range(n_data):
                points[row, d] = complex(level[0, d] * unit, level[1, d] * unit)
        for d in range(n_data):
            weight[d] = usual[d] * trust
        axis_llrs(level[0], weight, real_bits, room, bits)
        expected_levels(bits, real_bits, LLR_SCALE, mean[0], square[0])
        if imag_bits:
            axis_llrs(level[1], weight, imag_bits, room, lower)
            expected_levels(lower, imag_bits, LLR_SCALE, mean[1], square[1])
        sorted_llr = llr[row * n_bits : (row + 1) * n_bits]
        for k in range(n_bits):
            sorted_llr[k] = bits[axes.gather[k]]
        _learn(z[0], z[1], mean, unit * trust, sums)
        _add(square, unit * unit * trust, masses)
        for p in range(n_used - n_data):
            at = n_data + p
            sign = tones.pilots[p] * polarity[row] * trust
            sums[0, at] += z[0, at] * sign
            sums[1, at] += z[1, at] * sign
            masses[at] += trust
        certain = (_squares(mean[0]) + _squares(mean[1])) * unit * unit + (n_used - n_data)
        figures[CERTAIN] += certain * trust
        figures[N_HEARD] += 1
        if figures[N_HEARD] == BLOCK:
            _correct_channel(channel, tones)
            _renew(channel, tones, axes.unit, turns, inverse, usual)
