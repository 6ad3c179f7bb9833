"""Mean and mean square of each sent point, estimated from the LLRs of its bits.

An axis with Gray-coded bits 0, 1, …, m − 1 has the level ±R_1, where R_b = 2^(m − b) ± R_(b + 1)
and R_m = 1. So the means follow from the inside out, one bit at a time, with tanh(LLR / 2) as the
sign of a bit.
"""

import numpy as np
from numpy.typing import NDArray

from phy.kernels.demapper import LLR_SCALE
from phy.kernels.inline import step
from phy.kernels.lanes import Lanes, least, load, most, splat


@step
def expected_level(
    llr: NDArray[np.float32], axis_bits: int, at: int, stride: int
) -> tuple[Lanes, Lanes]:
    """(mean, mean square) of eight levels (odd numbers); LLRs of bit b are at `at + b stride`."""
    scale = splat(0.5 / LLR_SCALE)
    mean: Lanes = splat(1)
    square: Lanes = splat(1)
    for bit in range(axis_bits - 1, 0, -1):
        half = splat(1 << (axis_bits - bit))
        signed = _tanh(load(llr, at + bit * stride) * scale) * mean
        square = square + half * half + (half + half) * signed
        mean = half + signed
    return -_tanh(load(llr, at) * scale) * mean, square


@step
def _tanh(x: Lanes) -> Lanes:
    """The hyperbolic tangent, to within 2 %."""
    # At ±3 the quotient reaches ±1.
    x = least(most(x, splat(-3)), splat(3))
    square = x * x
    value: Lanes = x * (splat(27) + square) / (splat(27) + splat(9) * square)
    return value
