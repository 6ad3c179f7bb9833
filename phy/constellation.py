"""Bits to points, Gray-coded per axis (IEEE 802.11-2020, 17.3.5.8)."""

from enum import Enum
from functools import cache

import numpy as np
from numpy.typing import NDArray


class Modulation(Enum):
    """The modulation of a subcarrier; its value is the number of coded bits on a subcarrier."""

    BPSK = 1
    QPSK = 2
    QAM16 = 4
    QAM64 = 6
    QAM256 = 8

    # That of Enum runs in the interpreter, and every burst takes some.
    __hash__ = object.__hash__

    @property
    def bits(self) -> int:
        """Number of coded bits on one subcarrier."""
        return self.value

    @property
    def label(self) -> str:
        """The modulation's usual name, such as `16QAM`."""
        return f"{1 << self.bits}QAM" if self.bits > 2 else self.name

    @property
    def unit(self) -> float:
        """Half the distance between neighboring points, at mean power 1."""
        return _unit(self)

    @property
    def axis_bits(self) -> int:
        """Number of coded bits on one axis; BPSK uses the real axis only."""
        return max(1, self.bits // 2)


@cache
def _unit(modulation: Modulation) -> float:
    levels = _levels(modulation.axis_bits)
    axes = 1 if modulation is Modulation.BPSK else 2
    return float(1 / np.sqrt(axes * np.mean(levels**2)))


@cache
def points(modulation: Modulation) -> NDArray[np.complex64]:
    """Points of mean power 1 `[2^bits]`, indexed by their bits as a number, first bit highest."""
    levels = _levels(modulation.axis_bits) * modulation.unit
    if modulation is Modulation.BPSK:
        return levels.astype(np.complex64)
    return (levels[:, None] + 1j * levels[None, :]).reshape(-1).astype(np.complex64)


def _levels(axis_bits: int) -> NDArray[np.float64]:
    """Levels of an axis, odd numbers `[2^axis_bits]`, indexed by their Gray code as a number."""
    n = 1 << axis_bits
    rank = np.arange(n)
    levels = np.empty(n)
    levels[rank ^ rank >> 1] = 2 * rank - (n - 1)
    return levels
