"""What was sent, as far as the LLRs of its bits tell: mean and mean square of every point.

An axis with Gray-coded bits 0, 1, …, m − 1 has the level ±R_1, where R_b = 2^(m − b) ± R_(b + 1)
and R_m = 1. So means follow from the inside out, a bit at a time, with tanh(LLR / 2) for its sign.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(nogil=True, cache=True, error_model="numpy")
def expected_levels(
    planes: NDArray[np.int16],
    axis_bits: int,
    llr_scale: float,
    mean: NDArray[np.float32],
    square: NDArray[np.float32],
) -> None:
    """Mean and mean square of levels `[n]`, LLRs `planes` `[axis_bits · n]` bit by bit.

    LLRs are `llr_scale` a unit, levels odd numbers.
    """
    n = mean.size
    scale, two = np.float32(0.5 / llr_scale), np.float32(2)
    mean[:] = 1
    square[:] = 1
    for bit in range(axis_bits - 1, 0, -1):
        half = np.float32(1 << (axis_bits - bit))
        row = planes[bit * n : (bit + 1) * n]
        for d in range(n):
            signed = _tanh(np.float32(row[d]) * scale) * mean[d]
            square[d] += half * half + two * half * signed
            mean[d] = half + signed
    for d in range(n):
        mean[d] *= -_tanh(np.float32(planes[d]) * scale)


@njit(nogil=True, cache=True, error_model="numpy")
def _tanh(x: np.float32) -> np.float32:
    """To 2 %."""
    x = min(max(x, np.float32(-3)), np.float32(3))
    square = x * x
    return x * (np.float32(27) + square) / (np.float32(27) + np.float32(9) * square)
