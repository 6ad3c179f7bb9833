"""Phases that are linear over subcarriers."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from phy.kernels.inline import step
from phy.kernels.lanes import load, splat, store
from phy.kernels.local import local
from phy.sizes import N_LANES


@njit(nogil=True, cache=True, error_model="numpy")
def lean(slope: float, subcarriers: NDArray[np.int64], out: NDArray[np.float32]) -> None:
    """Write exp(j · slope · k) for each k of `subcarriers` `[n]` to `out` `[2, ≥ n]`."""
    edge = np.int64(0)
    for k in subcarriers:
        edge = max(edge, abs(k))
    step = complex(math.cos(slope), math.sin(slope))
    turns = local(np.complex64, edge + 1)
    turn = complex(1.0)
    for k in range(edge + 1):
        turns[k] = np.complex64(turn)
        turn *= step
    for i in range(subcarriers.size):
        k = subcarriers[i]
        out[0, i] = turns[abs(k)].real
        out[1, i] = turns[abs(k)].imag if k >= 0 else -turns[-k].imag


@step
def lean_more(slope: float, numbers: NDArray[np.float32], turns: NDArray[np.float32]) -> None:
    """Rotate `turns` `[2, width]` by slope · `numbers`; its series errs by 1e-7 at 0.1 rad."""
    by, one, width = splat(slope), splat(1), numbers.size
    half, sixth, rest = splat(-1 / 2), splat(-1 / 6), splat(1 / 24)
    for k in range(0, width, N_LANES):
        x = load(numbers, k) * by
        square = x * x
        c = one + square * (half + square * rest)
        s = x * (one + square * sixth)
        a, b = load(turns, k), load(turns, width + k)
        store(turns, k, a * c - b * s)
        store(turns, width + k, a * s + b * c)
