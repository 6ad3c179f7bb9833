"""What `phy.kernels.demapper` and `decisions` compute, said plainly: to read, and to check against.

In float32 throughout and in their order, so that the bits are the same.
"""

import numpy as np
from numpy.typing import NDArray

from phy.kernels.demapper import LLR_SCALE
from phy.kernels.viterbi import MAX_LLR

_F32 = np.float32


def axis_llrs_plain(
    level: NDArray[np.float32], weight: NDArray[np.float32], axis_bits: int
) -> NDArray[np.float32]:
    """LLRs `[axis_bits, n]` of `level` `[n]`, in units of half the levels' distance."""
    llr = np.empty((axis_bits, len(level)), np.float32)
    for bit in range(axis_bits):
        half = 1 << (axis_bits - 1 - bit)
        size = np.abs(level)
        k = np.arange(1, half + 1, dtype=np.float32)[:, None]
        outer = np.max(4 * k * size - 4 * k * (k - 1), axis=0)
        llr[bit] = np.copysign(np.minimum(weight * outer, _F32(MAX_LLR)), level if bit else -level)
        level = size - _F32(half)
    return llr


def expected_level_plain(
    llr: NDArray[np.float32],
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """(mean, mean square) of levels `[n]` with such LLRs `[axis_bits, n]`."""
    mean = square = np.ones(llr.shape[1], np.float32)
    for bit in range(len(llr) - 1, 0, -1):
        half = _F32(1 << (len(llr) - bit))
        signed = _tanh(llr[bit] * _F32(0.5 / LLR_SCALE)) * mean
        square = square + half * half + (half + half) * signed
        mean = half + signed
    return -_tanh(llr[0] * _F32(0.5 / LLR_SCALE)) * mean, square


def _tanh(x: NDArray[np.float32]) -> NDArray[np.float32]:
    x = np.clip(x, _F32(-3), _F32(3))
    square = x * x
    value: NDArray[np.float32] = x * (_F32(27) + square) / (_F32(27) + _F32(9) * square)
    return value
