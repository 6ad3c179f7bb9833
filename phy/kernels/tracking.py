"""Two Kalman filters on the pilots: the phase common to all subcarriers, and its slope over them.

The phase changes with the residual frequency offset and the oscillators' noise; the slope grows as
the sender's sampling clock drifts away from ours.
"""

import math

import numpy as np
from numpy.typing import NDArray

from phy.kernels.inline import step
from phy.tables.burst import DOUBT, PHASE, SLOPE, SPREAD

# Columns of the state: [value, rate, var(value), cov, var(rate)], rates per symbol.
# Process noise per symbol: phase noise of the oscillators, and modelling errors.
PHASE_NOISE = np.array([5e-5, 1e-10])
SLOPE_NOISE = np.array([1e-10, 1e-15])

INTERFERENCE, MOVEMENT = 3.0, 6.0
"""Excess of the pilots' errors over what is expected, as a factor, that is not chance."""
DIFFER = 2.5
"""The same if phase and amplitude count: it only hastens what is due."""
STEP = 4.5
"""Number of standard deviations from which a difference in amplitude or phase is a step of it."""
LEAST_STEP = 0.08
"""A smaller step, relative or in radians, is left to the filters, which are there as soon."""
CLEARLY = 0.03
"""Variance in rad² up to which pilots tell a step of phase: with more noise, angles mislead."""
LAST = 0.3
"""Share of a difference in amplitude with which its filter ends: that of the third symbol."""


@step
def predict(tracking: NDArray[np.float64]) -> None:
    """Advance both filters by one symbol: values change by their rates."""
    _predict(tracking[PHASE], PHASE_NOISE)
    _predict(tracking[SLOPE], SLOPE_NOISE)


@step
def _predict(state: NDArray[np.float64], noise: NDArray[np.float64]) -> None:
    state[0] += state[1]
    state[2] += 2 * state[3] + state[4] + noise[0]
    state[3] += state[4]
    state[4] += noise[1]


@step
def _correct(state: NDArray[np.float64], innovation: float, variance: float) -> None:
    """Update with a measurement of `variance` that differs from the prediction by `innovation`."""
    total = state[2] + variance
    gain, rate_gain = state[2] / total, state[3] / total
    state[0] += gain * innovation
    state[1] += rate_gain * innovation
    # From last to first: each needs the old values of those before it.
    state[4] -= rate_gain * state[3]
    state[3] -= gain * state[3]
    state[2] -= gain * state[2]


@step
def correct(
    turned: NDArray[np.complex128],
    power: NDArray[np.float64],
    subcarriers: NDArray[np.int64],
    no: float,
    figures: NDArray[np.float64],
    missed: NDArray[np.float64],
    tracking: NDArray[np.float64],
) -> tuple[float, float, float, bool]:
    """Correct phase and slope by pilots; returns (noise, movement, amplitude, whether they differ).

    `turned` `[n]` is the received pilots, rotated back as predicted, times the conjugate of the
    expected ones; `power` is the expected ones' squared magnitude. `no` is the noise on a
    subcarrier. Updated are the spread of the amplitude among the channel's `figures`, and `missed`:
    how the last symbol's pilots differed from what was expected.

    Pilots that differ by more than that are evidence of interference or of movement. Interference
    differs from symbol to symbol: it counts as noise, here and for the data. What stays is
    movement: the power that the gains' errors have beyond their doubt. An `amplitude` that is not
    1 is a step of gain; after one, it is a filter's for some symbols. Pilots that differ at
    all, phase and amplitude included, ask for a correction of the channel.
    """
    n, doubt, spread = turned.size, figures[DOUBT], figures[SPREAD]
    total, expected = 0j, 0.0
    for p in range(n):
        total += turned[p]
        expected += power[p]
    size = math.sqrt(total.real * total.real + total.imag * total.imag)
    if size == 0.0 or expected <= 0.0:
        return no, 0.0, 1.0, False
    common, more = complex(total.real / size, -total.imag / size), size / expected - 1
    variance = (no + doubt) / (2 * expected)
    if abs(more) > LEAST_STEP and more * more > STEP * STEP * (variance + spread):
        spread = 1.0
    amplitude = 1 + more * spread / (spread + variance)
    residual, change, whole = 0.0, 0.0, 0.0
    # Weighted least squares of the pilots' phases: w (θ − a − b k)², small angles.
    s0 = s1 = s2 = t0 = t1 = 0.0
    for p in range(n):
        k, weight = subcarriers[p], power[p]
        aligned = turned[p] * common
        # The imaginary part is the angle times |h|², so it is already weighted.
        theta = aligned.imag
        s0 += weight
        s1 += weight * k
        s2 += weight * k * k
        t0 += theta
        t1 += theta * k
        if weight > 0.0:
            share, re, im = 1 / weight, turned[p].real - weight, turned[p].imag
            whole += share * (re * re + im * im)
            re = aligned.real - amplitude * weight
            residual += share * (re * re + theta * theta)
            more_re, more_im = re - missed[0, p], theta - missed[1, p]
            change += share * (more_re * more_re + more_im * more_im)
            missed[0, p], missed[1, p] = re, theta
    differ = whole > DIFFER * (n * (no + doubt) + tracking[PHASE, 2] * expected)
    foreign = min(residual, change - n * no)
    movement = 0.0
    is_foreign = foreign > INTERFERENCE * n * (no + doubt)
    if is_foreign:
        no = foreign / n
    elif residual > MOVEMENT * n * (no + doubt):
        movement = residual / n - no - doubt
    if spread > 0:
        variance = (no + doubt + movement) / (2 * expected)
        share = spread / (spread + variance)
        amplitude, spread = 1 + more * share, spread * (1 - share)
        if share < LAST:
            # From here on, the gains' own filters do better.
            spread = 0.0
    figures[SPREAD] = spread
    det = s0 * s2 - s1 * s1
    if not det > 0.0:
        return no, movement, amplitude, differ
    offset = math.atan2(total.imag, total.real)
    # Only half of the noise, the part across a pilot, changes its angle.
    noise = 0.5 * (no + doubt + movement)
    jump, doubtful = offset + (s2 * t0 - s1 * t1) / det, tracking[PHASE, 2] + noise * s2 / det
    is_step = abs(jump) > LEAST_STEP and jump * jump > STEP * STEP * doubtful
    if is_step and doubtful < CLEARLY and not is_foreign:
        # Else data decided in a wrong quadrant would turn the gains along, for ever.
        tracking[PHASE, 2] += jump * jump
    _correct(tracking[PHASE], jump, noise * s2 / det)
    _correct(tracking[SLOPE], (s0 * t1 - s1 * t0) / det, noise * s0 / det)
    return no, movement, amplitude, differ
