"""Points to LLRs: exact max-log for Gray-coded axes of any size."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from phy.kernels.viterbi import MAX_LLR

LLR_SCALE = 8.0
"""Quantised LLRs are 1/8 each."""


@njit(nogil=True, cache=True)
def axis_llrs(
    level: NDArray[np.float32],
    weight: NDArray[np.float32],
    axis_bits: int,
    outer: NDArray[np.float32],
    out: NDArray[np.int16],
) -> None:
    """LLRs `[axis_bits · n]`, bit by bit, of `level` `[n]` in units of half the levels' distance.

    An LLR is the difference of squared distances to the nearest levels with the bit 1 and 0, times
    `weight`, quantised. That of the first bit is, of 2 m levels, ±max over k ≤ m of
    4 k |u| − 4 k (k − 1); each other bit is the first of the axis folded in the middle. `level` is
    used up, `outer` `[n]` is room to work.
    """
    n = level.size
    most, four = np.float32(MAX_LLR), np.float32(4)
    for bit in range(axis_bits):
        half = 1 << (axis_bits - 1 - bit)
        for d in range(n):
            outer[d] = four * abs(level[d])
        for k in range(2, half + 1):
            slope, offset = np.float32(4 * k), np.float32(4 * k * (k - 1))
            for d in range(n):
                outer[d] = max(outer[d], slope * abs(level[d]) - offset)
        row = out[bit * n : (bit + 1) * n]
        toward, fold = np.float32(-1 if bit == 0 else 1), np.float32(half)
        for d in range(n):
            value = toward * weight[d] * (outer[d] if level[d] > 0 else -outer[d])
            row[d] = np.int16(min(max(value, -most), most))
            level[d] = abs(level[d]) - fold
