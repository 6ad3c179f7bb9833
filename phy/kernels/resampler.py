"""Interpolates a signal at evenly spaced times between its samples."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from phy.kernels.lanes import Lanes, load, pairs, splat
from phy.sizes import N_LANES


@njit(nogil=True, cache=True, error_model="numpy")
def interpolate(
    parts: NDArray[np.float32],
    filters: NDArray[np.float32],
    start: float,
    step: float,
    out: NDArray[np.complex64],
) -> None:
    """out[n] = x(start + n · step), 0 outside; real and imaginary part of x are `parts` `[2, x]`.

    `filters` `[phases + 1, taps]`, nearest phase: filters[p, k] weighs
    x[floor(t) − taps / 2 + 1 + k] for t − floor(t) = p / phases.
    """
    n_phases, n_taps = filters.shape[0] - 1, filters.shape[1]
    size = parts.shape[1]
    for n in range(out.size):
        t = start + n * step
        whole = math.floor(t)
        phase = int((t - whole) * n_phases + 0.5)
        first = int(whole) - n_taps // 2 + 1
        low, high = max(0, -first), min(n_taps, size - first)
        if low >= high:
            out[n] = 0
            continue
        weights = filters[phase, low:high]
        at = first + low
        re = _dot(weights, parts[0, at:])
        im = _dot(weights, parts[1, at:])
        out[n] = complex(re, im)


@njit(
    nogil=True,
    cache=True,
    error_model="numpy",
    fastmath={"reassoc", "contract", "nsz"},
)
def _dot(weights: NDArray[np.float32], x: NDArray[np.float32]) -> np.float32:
    """The dot product of two rows, summed in whatever order is fastest."""
    total = np.float32(0)
    for k in range(weights.size):
        total += weights[k] * x[k]
    return total


@njit(nogil=True, cache=True, error_model="numpy")
def filter_strided(
    x: NDArray[np.complex64],
    first: int,
    stride: int,
    taps: NDArray[np.float32],
    out: NDArray[np.complex64],
    out_stride: int,
    n: int,
) -> None:
    """out[i · out_stride] = Σ_k taps[2 k] x[first + i · stride + k] for `n` outputs.

    `taps` contain each tap twice, then zeros up to whole lanes: `x` must be as long.
    """
    flat = x.view(np.float32)
    for i in range(n):
        at = 2 * (first + i * stride)
        both: Lanes = splat(0)
        for k in range(0, taps.size, N_LANES):
            both = both + load(flat, at + k) * load(taps, k)
        out[i * out_stride] = pairs(both)
