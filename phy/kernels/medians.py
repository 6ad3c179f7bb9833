"""The median of powers, by bisection: as exact as a limit in dB needs it."""

import math

import numpy as np
from numpy.typing import NDArray

from phy.kernels.inline import step

# Steps of the search between twice the mean and 100 dB less.
_STEPS, _LEAST = 13, 1e-10


@step
def median(power: NDArray[np.float32], mean: float) -> float:
    """The median of powers of that mean, to 0.01 dB; less by 100 dB is 0."""
    # Of each pair, the lower bound has at most half of the values below it, the upper one more.
    low, high = mean * _LEAST, 2.0 * mean
    for _ in range(_STEPS):
        middle, below = math.sqrt(low * high), 0
        limit = np.float32(middle)
        for k in range(power.size):
            below += power[k] < limit
        if below > power.size // 2:
            high = middle
        else:
            low = middle
    return math.sqrt(low * high)
