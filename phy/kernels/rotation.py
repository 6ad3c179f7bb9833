"""Phases that grow evenly over carriers."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(nogil=True, cache=True)
def lean(slope: float, carriers: NDArray[np.int64], out: NDArray[np.complex64]) -> None:
    """exp(j · slope · k) for each of `carriers` `[n]`."""
    edge = np.int64(0)
    for k in carriers:
        edge = max(edge, abs(k))
    step = complex(math.cos(slope), math.sin(slope))
    turns = np.empty(edge + 1, np.complex64)
    turn = complex(1.0)
    for k in range(edge + 1):
        turns[k] = np.complex64(turn)
        turn *= step
    for i in range(carriers.size):
        k = carriers[i]
        out[i] = turns[k] if k >= 0 else np.conj(turns[-k])
