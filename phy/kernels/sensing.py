"""Power in windows of 64 samples against a noise floor that follows the quiet ones.

A window's powers are kept and summed when it is full, always in the same order, so that its power
does not depend on how the stream was cut into chunks.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

WINDOW = 64
# What the state holds: the floor (0: none yet), the index after the last busy window, the index of
# the next sample, how many samples the window has so far, and their powers.
FLOOR, BUSY_UNTIL, NEXT, FILLED, POWERS = 0, 1, 2, 3, 4
N_STATE = POWERS + WINDOW

LEAST_FLOOR = 1e-12
# A signal that never ends is noise after a while: the floor doubles in so many busy windows.
DOUBLING = 1 << 17
_CREEP = 2 ** (1 / DOUBLING)
_WEIGHT = 1 / 64


@njit(nogil=True, cache=True)
def sense(
    x: NDArray[np.complex64], threshold: float, limit: float, state: NDArray[np.float64]
) -> None:
    """Take samples `[n]`: a window is busy when its mean power exceeds `threshold` · floor.

    Samples that are not finite or larger than `limit` are bad: they count as no power.
    """
    powers = state[POWERS:]
    filled = int(state[FILLED])
    at = 0
    while at < x.size:
        n = min(WINDOW - filled, x.size - at)
        part, room = x[at : at + n], powers[filled : filled + n]
        for i in range(n):
            room[i] = part[i].real * part[i].real + part[i].imag * part[i].imag
        at += n
        filled += n
        if filled == WINDOW:
            _judge(powers, threshold, limit * limit, state[NEXT] + at, state)
            filled = 0
    state[FILLED] = filled
    state[NEXT] += x.size


@njit(nogil=True, cache=True)
def _judge(
    powers: NDArray[np.float64],
    threshold: float,
    limit: float,
    end: float,
    state: NDArray[np.float64],
) -> None:
    """Judge a full window that is over at index `end`: mark the channel busy, follow the floor."""
    power = _mean(powers)
    # Also true of NaN. A bad sample makes its window's mean so large, or no number.
    spoilt = not power < limit / WINDOW
    if spoilt:
        spoilt = _without_bad(powers, limit) > 0
        power = _mean(powers)
    floor = state[FLOOR]
    busy = floor > 0 and power > threshold * floor
    if busy:
        state[BUSY_UNTIL] = end
    if busy:
        floor *= _CREEP
    elif spoilt:
        # Its power is too low by who knows what; a floor too low would call all noise busy.
        return
    elif floor == 0 or power < floor / 2:
        floor = power
    else:
        floor += _WEIGHT * (power - floor)
    state[FLOOR] = max(floor, LEAST_FLOOR)


@njit(nogil=True, cache=True)
def _mean(powers: NDArray[np.float64]) -> float:
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    for i in range(0, WINDOW, 4):
        a += powers[i]
        b += powers[i + 1]
        c += powers[i + 2]
        d += powers[i + 3]
    return ((a + b) + (c + d)) / WINDOW


@njit(nogil=True, cache=True)
def _without_bad(powers: NDArray[np.float64], limit: float) -> int:
    """Set powers that are not finite or exceed `limit` to 0; returns how many there were."""
    bad = 0
    for i in range(powers.size):
        if not powers[i] <= limit:
            powers[i] = 0
            bad += 1
    return bad
