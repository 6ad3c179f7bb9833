"""Converts points to LLRs: exact max-log for Gray-coded axes, eight subcarriers at once."""

import numpy as np
from numpy.typing import NDArray

from phy.kernels.inline import step
from phy.kernels.lanes import Lanes, least, magnitude, most, splat, store, with_sign
from phy.sizes import MAX_LLR

LLR_SCALE = 8.0
"""Factor from an LLR to its quantised value, in steps of 1/8."""


@step
def axis_llrs(
    level: Lanes, weight: Lanes, axis_bits: int, out: NDArray[np.float32], at: int, stride: int
) -> None:
    """Write the LLRs of eight levels, those of bit b from `out[at + b stride]` on.

    `level` is in units of half the level distance. An LLR is the difference of the squared
    distances to the nearest levels with the bit 1 and 0, times `weight`. For the first bit of 2 m
    levels it is ±max over k ≤ m of 4 k |u| − 4 k (k − 1). Each further bit is the first bit of the
    axis folded in the middle.
    """
    limit = splat(MAX_LLR)
    for bit in range(axis_bits):
        half = 1 << (axis_bits - 1 - bit)
        size = magnitude(level)
        outer = splat(4) * size
        for k in range(2, half + 1):
            outer = most(outer, splat(4 * k) * size - splat(4 * k * (k - 1)))
        value = with_sign(least(weight * outer, limit), level if bit else -level)
        store(out, at + bit * stride, value)
        level = size - splat(half)
