"""Demapper: turns equalised points into LLRs, and LLRs into the likely sent points.

It computes in single precision, in the order of the kernels `demapper` and `decisions`, so the bits
are equal. Both axes of a point are handled alike. Levels of an axis are odd numbers, in units of
half the distance of neighboring points.
"""

import numpy as np
from numpy.typing import NDArray

from phy.reference.viterbi import MAX_LLR

Levels = NDArray[np.float32]

LLR_SCALE = 8.0
"""Factor of quantised LLRs, in steps of 1/8."""
_F32 = np.float32


def axis_llrs(level: Levels, weight: Levels, axis_bits: int) -> Levels:
    """Convert levels `[n]` to LLRs of each bit of the axis `[axis_bits, n]`, at most ±MAX_LLR.

        L = w (min_{x: bit 1} |u − x|² − min_{x: bit 0} |u − x|²)

    For the first bit of 2m levels that is ±max over k ≤ m of 4k|u| − 4k(k − 1): a few straight
    lines, no search. Each further bit is the first bit of the axis folded in the middle, because
    the bits are Gray-coded.
    """
    llr = np.empty((axis_bits, len(level)), np.float32)
    for bit in range(axis_bits):
        half = 1 << (axis_bits - 1 - bit)
        size = np.abs(level)
        k = np.arange(1, half + 1, dtype=np.float32)[:, None]
        outer = np.max(4 * k * size - 4 * k * (k - 1), axis=0)
        llr[bit] = np.copysign(np.minimum(weight * outer, _F32(MAX_LLR)), level if bit else -level)
        level = size - _F32(half)
    return llr


def expected_levels(llr: Levels) -> tuple[Levels, Levels]:
    """Estimate mean E s and mean square E s² of the sent levels `[n]` from LLRs `[axis_bits, n]`.

        E(1 − 2 bit) = tanh(L/2);  level ±R_1, R_b = 2^(m − b) ± R_(b + 1), R_m = 1

    Bits count from 0, so that R_1 follows from the inside out, one bit at a time.
    """
    mean = square = np.ones(llr.shape[1], np.float32)
    for bit in range(len(llr) - 1, 0, -1):
        half = _F32(1 << (len(llr) - bit))
        signed = _tanh(llr[bit] * _F32(0.5 / LLR_SCALE)) * mean
        square = square + half * half + (half + half) * signed
        mean = half + signed
    return -_tanh(llr[0] * _F32(0.5 / LLR_SCALE)) * mean, square


def _tanh(x: Levels) -> Levels:
    """Approximate tanh x by x (27 + x²) / (27 + 9x²), to 2 %, and by ±1 beyond ±3."""
    x = np.clip(x, _F32(-3), _F32(3))
    square = x * x
    value: Levels = x * (_F32(27) + square) / (_F32(27) + _F32(9) * square)
    return value
