"""Subcarriers to LLRs: tracks phase, timing and channel, equalises, demaps, de-interleaves."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from phy.kernels.decisions import expected_level
from phy.kernels.demapper import LLR_SCALE, axis_llrs
from phy.kernels.inline import step
from phy.kernels.lanes import Lanes, load, splat, store, store_int16, total
from phy.kernels.rotation import lean, lean_more
from phy.kernels.smoothing import doubt_more, follow, move_on, scale
from phy.kernels.tracking import correct, predict
from phy.sizes import N_LANES
from phy.tables.burst import (
    CERTAIN,
    DOUBT,
    DUE,
    GAIN,
    MOVES,
    N_HEARD,
    N_ODD,
    NO,
    PHASE,
    SLOPE,
    SLOPE_USED,
    WRONG,
    Axes,
    Channel,
    Row,
    Scratch,
    Tones,
)

NO_STEP = 4.0
"""Times the noise by which data may be off behind a step of gain; else others are on the air."""
# With less trust than this, a symbol is of another burst.
_ODD = 0.25
# With less certainty than this in the symbols since the last correction, there is none.
_LEAST_MASS = 1 / 16
# Noise floor relative to the signal: echoes and converters always leave this share.
_LEAST_NOISE = 1e-4
# Frequency error of the preamble's estimate, in subcarrier spacings: at 0 dB, and at best.
_FREQUENCY_ERROR_0_DB = 0.006
_FREQUENCY_ERROR_MIN = 0.0005
# Standard deviations of the sampling clock's error: unknown, and derived from the centre frequency.
_CLOCK_ERROR, _CLOCK_DOUBT = 40e-6, 5e-6
# Lag in radians of the outermost subcarriers behind the slope at which their turn is recomputed.
_LAG = 0.01
# Twice the turn of the outermost subcarriers up to which a series is accurate enough.
_SMALL = 0.2


@step
def _noise(channel: Channel) -> float:
    return float(max(channel.figures[NO], _LEAST_NOISE * channel.figures[GAIN]))


@njit(nogil=True, cache=True, error_model="numpy")
def start_tracking(tones: Tones, channel: Channel, clock_error: float, is_known: bool) -> None:
    """Initialise phase, slope and their uncertainty as they are after the preamble.

    `clock_error` is the relative excess of the sender's sampling clock, as far as it is known;
    pilots may correct it.
    """
    figures, tracking = channel.figures, channel.tracking
    error = _FREQUENCY_ERROR_0_DB * math.sqrt(figures[NO] / figures[GAIN])
    turn = 2 * math.pi * tones.n_symbol / tones.n_fft
    tracking[:] = 0
    tracking[PHASE, 4] = (turn * max(error, _FREQUENCY_ERROR_MIN)) ** 2
    tracking[SLOPE, 1] = turn * clock_error
    tracking[SLOPE, 4] = (turn * (_CLOCK_DOUBT if is_known else _CLOCK_ERROR)) ** 2
    channel.sums[:] = 0
    channel.masses[:] = 0
    channel.missed[:] = 0
    figures[N_HEARD] = figures[CERTAIN] = figures[WRONG] = figures[SLOPE_USED] = 0
    lean(0.0, tones.subcarriers, channel.turns)
    renew(channel)


@step
def use_slope(slope: float, tones: Tones, channel: Channel) -> None:
    """From now on, rotate subcarriers back by `slope` radians per subcarrier."""
    more = channel.figures[SLOPE_USED] - slope
    channel.figures[SLOPE_USED] = slope
    if abs(more) * tones.n_fft < _SMALL:
        lean_more(more, tones.numbers, channel.turns)
    else:
        lean(-slope, tones.subcarriers, channel.turns)


@step
def renew(channel: Channel) -> None:
    """Compute from the gains what equalising needs: their certainty and their inverse."""
    h, inverse, width = channel.h, channel.inverse, channel.certainty.size
    scale, one = splat(LLR_SCALE / _noise(channel)), splat(1)
    tiny = splat(1e-30)
    for k in range(0, width, N_LANES):
        re, im = load(h, k), load(h, width + k)
        power = re * re + im * im
        store(channel.certainty, k, power * scale)
        share = one / (power + tiny)
        store(inverse, k, re * share)
        store(inverse, width + k, -im * share)


@step
def _make_whole(re: Row, im: Row, whole: float, channel: Channel) -> float:
    """Scale up a symbol of which only a share is `whole`; returns its noise on a subcarrier.

    The rest was blanked: that lets power of all subcarriers leak into each.
    """
    by = splat(1 / whole)
    for k in range(0, re.size, N_LANES):
        store(re, k, load(re, k) * by)
        store(im, k, load(im, k) * by)
    return float((_noise(channel) + channel.figures[GAIN] * (1 - whole)) / whole)


@step
def _pilots(
    re: Row, im: Row, kept: Row, no: float, polarity: float, tones: Tones, channel: Channel,
    scratch: Scratch,
) -> tuple[float, float]:  # fmt: skip
    """Track a symbol's phase, slope and amplitude by its pilots; returns (noise, amplitude).

    `no` is the noise on a subcarrier, as far as it is known before.
    """
    tracking, turned, power = channel.tracking, scratch.turned, scratch.pilot_power
    predict(tracking)
    back = complex(math.cos(tracking[PHASE, 0]), -math.sin(tracking[PHASE, 0])) * polarity
    behind = channel.figures[SLOPE_USED] - tracking[SLOPE, 0]
    for p in range(tones.pilots.size):
        at = tones.n_data + p
        h = complex(channel.h[0, at], channel.h[1, at])
        turn = complex(channel.turns[0, at], channel.turns[1, at])
        turn *= complex(1.0, behind * tones.subcarriers[at]) * (back * tones.pilots[p])
        turned[p] = complex(re[at], im[at]) * h.conjugate() * turn
        power[p] = h.real * h.real + h.imag * h.imag
        if kept[at] == 0:
            turned[p], power[p] = 0j, 0.0
    subcarriers = tones.subcarriers[tones.n_data :]
    no, movement, amplitude, differ = correct(
        turned, power, subcarriers, no, channel.figures, channel.missed, tracking
    )
    if amplitude != 1.0:
        scale(amplitude, channel)
        renew(channel)
    if movement > 0.0:
        doubt_more(movement, tones, channel)
    if differ or movement > 0.0:
        channel.figures[DUE] = 1
    return no, amplitude


@step
def _data(
    re: Row, im: Row, kept: Row, c: float, s: float, trust: float, belief: float, axes: Axes,
    channel: Channel, scratch: Scratch, n: int,
) -> tuple[float, float]:  # fmt: skip
    """Convert a symbol's `n` data subcarriers to levels, and to LLRs plane by plane.

    The subcarriers are rotated by c + js and by the slope in use. Their certainty is `belief` times
    that of the gains. With their likely values, they are added to the channel's sums and masses,
    times `trust`. Returns the certain part of them, Σ |E s|² times `trust`, and what wrong ones
    contribute: Σ |h|² (E|s|² − |E s|²), likewise, in units of LLRs.
    """
    width = channel.masses.size
    turns, inverse, sums = channel.turns, channel.inverse, channel.sums
    masses, certainty = channel.masses, channel.certainty
    level, llr, unit = scratch.level, scratch.llr, axes.unit
    real_bits, imag_bits, imag_at = axes.real_bits, axes.imag_bits, axes.real_bits * n
    cos, sin, per_unit = splat(c), splat(s), splat(1 / unit)
    sureness, believed = splat(unit * unit * trust), splat(unit * unit * belief)
    by = splat(unit * trust)
    certain: Lanes = splat(0)
    wrong: Lanes = splat(0)
    for d in range(0, n, N_LANES):
        a, b = load(re, d), load(im, d)
        a, b = a * cos - b * sin, a * sin + b * cos
        turn_re, turn_im = load(turns, d), load(turns, width + d)
        a, b = a * turn_re - b * turn_im, a * turn_im + b * turn_re
        by_re, by_im = load(inverse, d) * per_unit, load(inverse, width + d) * per_unit
        level_re, level_im = a * by_re - b * by_im, a * by_im + b * by_re
        store(level, d, level_re)
        store(level, width + d, level_im)
        keep = load(kept, d)
        known = load(certainty, d) * keep
        sure = known * believed
        axis_llrs(level_re, sure, real_bits, llr, d, n)
        mean_re, square = expected_level(llr, real_bits, d, n)
        mean_im: Lanes = splat(0)
        if imag_bits:
            axis_llrs(level_im, sure, imag_bits, llr, imag_at + d, n)
            mean_im, square_im = expected_level(llr, imag_bits, imag_at + d, n)
            square = square + square_im
        store(sums, d, load(sums, d) + (a * mean_re + b * mean_im) * by)
        store(sums, width + d, load(sums, width + d) + (b * mean_re - a * mean_im) * by)
        store(masses, d, load(masses, d) + square * sureness * keep)
        mean = mean_re * mean_re + mean_im * mean_im
        certain = certain + mean
        wrong = wrong + known * (square - mean)
    size = unit * unit * trust
    return float(total(certain)) * size, float(total(wrong)) * size


@njit(nogil=True, cache=True, error_model="numpy")
def _off(
    re: Row, im: Row, kept: Row, c: float, s: float, belief: float, axes: Axes, channel: Channel,
    scratch: Scratch, n: int,
) -> float:  # fmt: skip
    """How far a symbol's points are from those decided, as a share of the noise; see `_data`."""
    _data(re, im, kept, c, s, 0.0, belief, axes, channel, scratch, n)
    level, llr, certainty, width = scratch.level, scratch.llr, channel.certainty, re.size
    real_bits, imag_bits, unit = axes.real_bits, axes.imag_bits, axes.unit
    off: Lanes = splat(0)
    for d in range(0, n, N_LANES):
        mean_re, _ = expected_level(llr, real_bits, d, n)
        mean_im: Lanes = splat(0)
        if imag_bits:
            mean_im, _ = expected_level(llr, imag_bits, real_bits * n + d, n)
        off_re, off_im = load(level, d) - mean_re, load(level, width + d) - mean_im
        off = off + load(certainty, d) * load(kept, d) * (off_re * off_re + off_im * off_im)
    return float(total(off)) * unit * unit / (LLR_SCALE * n)


@step
def _learn_pilots(
    re: Row, im: Row, kept: Row, turned_by: complex, trust: float, polarity: float, tones: Tones,
    channel: Channel,
) -> None:  # fmt: skip
    """Add the pilots' evidence about their subcarriers' gains to the channel's sums and masses."""
    for p in range(tones.pilots.size):
        at = tones.n_data + p
        turn = complex(channel.turns[0, at], channel.turns[1, at])
        z = complex(re[at], im[at]) * turned_by * turn
        sign = tones.pilots[p] * polarity * trust * kept[at]
        channel.sums[0, at] += z.real * sign
        channel.sums[1, at] += z.imag * sign
        channel.masses[at] += trust * kept[at]


@step
def _correct_channel(tones: Tones, channel: Channel, scratch: Scratch) -> None:
    """Correct the gains with the last symbols, as decided.

    This is a step of expectation maximisation. Uncertainty makes such a step too short; it is
    lengthened to compensate. A wrong decision disturbs it like noise.
    """
    figures, sums, h, width = channel.figures, channel.sums, channel.h, channel.masses.size
    mass, n = figures[CERTAIN] / tones.bins.size, int(figures[N_HEARD])
    if mass > _LEAST_MASS:
        share = splat(1 / mass)
        for k in range(0, width, N_LANES):
            re, im, known = load(h, k), load(h, width + k), load(channel.masses, k)
            store(sums, k, (load(sums, k) - re * known) * share)
            store(sums, width + k, (load(sums, width + k) - im * known) * share)
        noise = _noise(channel) + max(0.0, figures[WRONG]) / figures[CERTAIN]
        follow(sums, noise / mass, n, tones, channel, scratch)
        renew(channel)
    sums[:] = 0
    channel.masses[:] = 0
    figures[N_HEARD] = figures[CERTAIN] = figures[WRONG] = 0


@njit(nogil=True, cache=True, error_model="numpy")
def equalise(
    y: NDArray[np.float32],
    n: int,
    number: int,
    tones: Tones,
    axes: Axes,
    channel: Channel,
    scratch: Scratch,
    points: NDArray[np.complex64],
    llr: NDArray[np.int16],
    first: int,
) -> None:
    """Write the LLRs of `n` symbols in the code's order, positive for 0, from symbol `first` on.

    `y` `[≥ n, 2, width]` has real and imaginary parts, in the order of tones. Its first symbol is
    number `number`; the header's first symbol is 0. `channel` carries over from call to call.
    `points` `[…, n_data]` gets the equalised points if it has any rows. The rows of
    `channel.kept`, `whole` and `trust` are those of `llr`, and repeat.
    """
    n_data, n_bits, unit = tones.n_data, axes.gather.size, axes.unit
    gather, planes, figures = axes.gather, scratch.planes, channel.figures
    n_pilots = tones.bins.size - n_data
    # The slope at which subcarrier n_fft / 2, beyond the outermost one, turns by _LAG.
    most_lag = _LAG / tones.n_fft * 2
    for row in range(n):
        re, im, polarity = y[row, 0], y[row, 1], tones.polarity[number + row]
        if figures[MOVES] > 0:
            move_on(tones, channel)
            renew(channel)
        place = (first + row) % channel.whole.size
        kept, known = channel.kept[place], _noise(channel)
        if channel.whole[place] < 1:
            known = _make_whole(re, im, channel.whole[place], channel)
        no, amplitude = _pilots(re, im, kept, known, polarity, tones, channel, scratch)
        if abs(channel.tracking[SLOPE, 0] - figures[SLOPE_USED]) > most_lag:
            use_slope(channel.tracking[SLOPE, 0], tones, channel)
        # A symbol with more noise than the preamble, as under interference, counts less.
        phase, trust = channel.tracking[PHASE, 0], _noise(channel) / no
        belief = _noise(channel) / (no + figures[DOUBT])
        c, s = math.cos(phase), -math.sin(phase)
        if amplitude != 1.0:
            # Pilots of another burst may look like a step of gain; its data do not.
            off = _off(re, im, kept, c, s, belief, axes, channel, scratch, n_data)
            if off > NO_STEP:
                no = off * _noise(channel)
                trust, belief = 1 / off, _noise(channel) / (no + figures[DOUBT])
        channel.trust[place] = trust
        figures[N_ODD] = figures[N_ODD] + 1 if known < _ODD * no else 0
        certain, wrong = _data(re, im, kept, c, s, trust, belief, axes, channel, scratch, n_data)
        if points.shape[0]:
            for d in range(n_data):
                re_level, im_level = scratch.level[0, d], scratch.level[1, d]
                points[first + row, d] = complex(re_level * unit, im_level * unit)
        for i in range(0, n_bits, N_LANES):
            store_int16(planes, i, load(scratch.llr, i))
        at = (first + row) * n_bits
        for k in range(n_bits):
            llr[at + k] = planes[gather[k]]
        _learn_pilots(re, im, kept, complex(c, s), trust, polarity, tones, channel)
        figures[CERTAIN] += certain + n_pilots * trust
        figures[WRONG] += wrong * _noise(channel) / LLR_SCALE
        figures[N_HEARD] += 1
        if figures[N_HEARD] >= figures[DUE]:
            _correct_channel(tones, channel, scratch)
