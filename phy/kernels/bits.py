"""Bits in words of 64, the first bit lowest."""

from typing import Any

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic
from numpy.typing import NDArray

from phy.kernels.inline import step
from phy.kernels.lanes import place

Words = NDArray[np.uint64]

ONE = np.uint64(1)
_64 = np.uint64(64)
_LANES = 32
_I16, _I32 = ir.IntType(16), ir.IntType(32)
_VECTOR = ir.VectorType(_I16, _LANES)
# Masks of halves, quarters and eighths of a byte that swap places when its bits are reversed.
_TURNS = ((4, 0x0F0F0F0F0F0F0F0F), (2, 0x3333333333333333), (1, 0x5555555555555555))


def _signs_generator(_context: Any, array: Any, at: Any) -> Any:
    """A word whose bit i is 1 where `array[at + i]` is negative, for 32 int16."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        values = builder.load(place(context, builder, signature, args, _VECTOR))
        values.align = 2
        zero = ir.Constant(_VECTOR, [ir.Constant(_I16, 0)] * _LANES)
        return builder.bitcast(builder.icmp_signed("<", values, zero), _I32)

    return types.uint32(array, at), generate


_signs: Any = intrinsic(_signs_generator)


@njit(nogil=True, cache=True, error_model="numpy")
def put(out: Words, at: int, word: np.uint64, n: int) -> None:
    """Write the lowest `n` bits of `word` from bit `at` on; that place must hold zeros."""
    i, bit = at >> 6, np.uint64(at & 63)
    out[i] |= word << bit
    if bit + np.uint64(n) > _64:
        out[i + 1] |= word >> (_64 - bit)


@njit(nogil=True, cache=True, error_model="numpy")
def get(words: Words, at: int, n: int) -> np.uint64:
    """The `n` ≤ 64 bits from bit `at` on, as a word."""
    i, bit = at >> 6, np.uint64(at & 63)
    word: np.uint64 = words[i] >> bit
    if bit + np.uint64(n) > _64:
        word |= words[i + 1] << (_64 - bit)
    word &= low_ones(n)
    return word


@njit(nogil=True, cache=True, error_model="numpy")
def low_ones(n: int) -> np.uint64:
    """A word with ones in its `n` ≤ 64 lowest bits."""
    return ~np.uint64(0) if n >= 64 else (ONE << np.uint64(n)) - ONE


@njit(nogil=True, cache=True, error_model="numpy")
def put_signs(values: NDArray[np.int16], first: int, n: int, out: Words, at: int) -> None:
    """Write the signs of `n` values from `first` on as bits from `at` on: 1 where negative."""
    whole = n - n % _LANES
    for i in range(0, whole, _LANES):
        put(out, at + i, np.uint64(_signs(values, first + i)), _LANES)
    for i in range(whole, n):
        put(out, at + i, np.uint64(values[first + i] < 0), 1)


@step
def _turned(word: np.uint64) -> np.uint64:
    """The word with the bits of each byte in reverse order."""
    for step_bits, mask in _TURNS:
        kept = np.uint64(mask)
        word = (word >> np.uint64(step_bits)) & kept | (word & kept) << np.uint64(step_bits)
    return word


@njit(nogil=True, cache=True, error_model="numpy")
def to_octets(words: Words, out: NDArray[np.uint8]) -> None:
    """Write words of bits as bytes, the first bit of each byte the highest."""
    for i in range(words.size):
        word = _turned(words[i])
        for b in range(min(8, out.size - 8 * i)):
            out[8 * i + b] = np.uint8(word >> np.uint64(8 * b) & np.uint64(255))


@njit(nogil=True, cache=True, error_model="numpy")
def from_octets(octets: NDArray[np.uint8], out: Words) -> None:
    """Write bytes as words of bits, with zeros after the last byte."""
    for i in range(out.size):
        word = np.uint64(0)
        for b in range(min(8, octets.size - 8 * i)):
            word |= np.uint64(octets[8 * i + b]) << np.uint64(8 * b)
        out[i] = _turned(word)
