"""Interpolation of a signal at evenly spaced times between its samples."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(nogil=True, cache=True)
def interpolate(
    x: NDArray[np.complex64],
    filters: NDArray[np.float32],
    start: float,
    step: float,
    out: NDArray[np.complex64],
) -> None:
    """out[n] = x(start + n · step), 0 outside. `filters` `[phases + 1, taps]`, nearest phase.

    filters[p, k] weighs x[floor(t) − taps / 2 + 1 + k] for t − floor(t) = p / phases.
    """
    n_phases, n_taps = filters.shape[0] - 1, filters.shape[1]
    for n in range(out.size):
        t = start + n * step
        whole = math.floor(t)
        phase = int((t - whole) * n_phases + 0.5)
        first = int(whole) - n_taps // 2 + 1
        low, high = max(0, -first), min(n_taps, x.size - first)
        re, im = np.float32(0), np.float32(0)
        for k in range(low, high):
            value = x[first + k]
            re += filters[phase, k] * value.real
            im += filters[phase, k] * value.imag
        out[n] = complex(re, im)
