"""The encoder of quasi-cyclic LDPC codes; see `phy.kernels.ldpc` for the terms.

A block of Z ≤ 128 bits is two words, bit 0 lowest. A block column's block, shifted by s, are the
bits from s on of the block repeated: of three words of which two are taken.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from phy.kernels.ldpc import N_COLUMNS

Words = NDArray[np.uint64]

_ONE, _63, _64 = np.uint64(1), np.uint64(63), np.uint64(64)


@njit(nogil=True, cache=True)
def _repeat(low: np.uint64, high: np.uint64, z: int, out: Words) -> None:
    """The `z` bits of `low` and `high`, and after them the same again; `out` `[5]`."""
    out[:] = 0
    out[0], out[1] = low, high
    word, bit = z >> 6, np.uint64(z & 63)
    for i in range(2):
        value = low if i == 0 else high
        out[word + i] |= value << bit
        if bit:
            out[word + i + 1] |= value >> (_64 - bit)


@njit(nogil=True, cache=True)
def _mask(z: int) -> tuple[np.uint64, np.uint64]:
    """Ones in the `z` lowest places."""
    full = ~np.uint64(0)
    if z >= 64:
        return full, (_ONE << np.uint64(z - 64)) - _ONE
    return (_ONE << np.uint64(z)) - _ONE, np.uint64(0)


@njit(nogil=True, cache=True)
def _part(repeated: Words, first: int, i: int) -> np.uint64:
    """The `i`-th word of the bits from `first` on."""
    word, bit = (first >> 6) + i, np.uint64(first & 63)
    low: np.uint64 = repeated[word] >> bit
    if bit:
        low |= repeated[word + 1] << (_64 - bit)
    return low


@njit(nogil=True, cache=True)
def _read(bits: NDArray[np.uint8], first: int, n: int) -> np.uint64:
    """Up to 64 bits as a word."""
    word = np.uint64(0)
    for i in range(n):
        word |= np.uint64(bits[first + i]) << np.uint64(i)
    return word


@njit(nogil=True, cache=True)
def encode_codeword(
    bits: NDArray[np.uint8],
    z: int,
    row_ends: NDArray[np.int32],
    columns: NDArray[np.int32],
    shifts: NDArray[np.int32],
    middle: int,
    out: NDArray[np.uint8],
) -> None:
    """The parity `out` `[rows · z]` of the information `bits` `[K z]`.

    Parity columns 1, 2, … are a staircase; column 0 has three blocks, in the first and last row
    with shift 1 and in row `middle` with 0. In the sum of all rows only the latter remains.
    """
    n_rows, n_info = row_ends.size - 1, bits.size // z
    low_mask, high_mask = _mask(z)
    repeated = np.empty((n_info, 5), np.uint64)
    for column in range(n_info):
        low = _read(bits, column * z, min(z, 64))
        high = _read(bits, column * z + 64, z - 64) if z > 64 else np.uint64(0)
        _repeat(low, high, z, repeated[column])
    sums, parity = np.zeros((n_rows, 2), np.uint64), np.zeros((n_rows, 2), np.uint64)
    for row in range(n_rows):
        for edge in range(row_ends[row], row_ends[row + 1]):
            if columns[edge] < n_info:
                for i in range(2):
                    sums[row, i] ^= _part(repeated[columns[edge]], shifts[edge], i)
        sums[row, 0] &= low_mask
        sums[row, 1] &= high_mask
        parity[0] ^= sums[row]
    turned = np.empty(5, np.uint64)
    _repeat(parity[0, 0], parity[0, 1], z, turned)
    # From row 0 down: bit column r + 1 is what row r lacks.
    lacks = np.empty(2, np.uint64)
    lacks[0] = sums[0, 0] ^ (_part(turned, 1 % z, 0) & low_mask)
    lacks[1] = sums[0, 1] ^ (_part(turned, 1 % z, 1) & high_mask)
    for row in range(1, n_rows):
        parity[row] = lacks
        lacks ^= sums[row]
        if row == middle:
            lacks ^= parity[0]
    for row in range(n_rows):
        for i in range(z):
            out[row * z + i] = parity[row, i >> 6] >> np.uint64(i & 63) & _ONE


@njit(nogil=True, cache=True)
def encode_blocks(
    blocks: NDArray[np.uint8],
    z: int,
    row_ends: NDArray[np.int32],
    columns: NDArray[np.int32],
    shifts: NDArray[np.int32],
    middle: int,
    shares: NDArray[np.int32],
    ends: NDArray[np.int32],
    out: NDArray[np.uint8],
) -> None:
    """Each block in codewords of `shares` bits; with parity, each goes up to its of `ends`."""
    n_rows = row_ends.size - 1
    bits = np.zeros((N_COLUMNS - n_rows) * z, np.uint8)
    parity = np.empty(n_rows * z, np.uint8)
    for block in range(blocks.shape[0]):
        at = 0
        for number in range(shares.size):
            share = shares[number]
            bits[:share] = blocks[block, at : at + share]
            bits[share:] = 0
            at += share
            encode_codeword(bits, z, row_ends, columns, shifts, middle, parity)
            middle_at = ends[number] + share
            out[block, ends[number] : middle_at] = bits[:share]
            out[block, middle_at : ends[number + 1]] = parity[: ends[number + 1] - middle_at]
