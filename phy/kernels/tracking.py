"""Two Kalman filters on the pilots: the phase common to all subcarriers, and its slope over them.

The phase changes with the residual frequency offset and the oscillators' noise; the slope grows as
the sender's sampling clock drifts away from ours.
"""

import math

import numpy as np
from numpy.typing import NDArray

from phy.kernels.inline import step
from phy.tables.burst import PHASE, SLOPE

# Columns of the state: [value, rate, var(value), cov, var(rate)], rates per symbol.
# Process noise per symbol: phase noise of the oscillators, and modelling errors.
PHASE_NOISE = np.array([5e-5, 1e-10])
SLOPE_NOISE = np.array([1e-10, 1e-15])

SURPRISE = 6.0
"""Excess over the preamble's noise, as a factor, at which a symbol's pilots and data lose trust."""


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
    tracking: NDArray[np.float64],
) -> float:
    """Correct phase and slope by pilots; returns the noise power on a subcarrier that they show.

    `turned` `[n]` is the received pilots, rotated back as predicted, times the conjugate of the
    expected ones; `power` is the expected ones' squared magnitude. If pilots disagree by more than
    `no` explains, their own noise counts instead, here and for the data around them: interference
    that the preamble did not see.
    """
    n = turned.size
    total = 0j
    for p in range(n):
        total += turned[p]
    size = math.sqrt(total.real * total.real + total.imag * total.imag)
    if size == 0.0:
        return no
    common = (total / size).conjugate()
    residual = 0.0
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
            error = aligned - weight
            residual += (error.real * error.real + error.imag * error.imag) / weight
    if residual > SURPRISE * n * no:
        no = residual / n
    det = s0 * s2 - s1 * s1
    if not det > 0.0:
        return no
    offset = math.atan2(total.imag, total.real)
    # Only half of the noise, the part across a pilot, changes its angle.
    _correct(tracking[PHASE], offset + (s2 * t0 - s1 * t1) / det, 0.5 * no * s2 / det)
    _correct(tracking[SLOPE], (s0 * t1 - s1 * t0) / det, 0.5 * no * s0 / det)
    return no
