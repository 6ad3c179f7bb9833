"""The encoder of quasi-cyclic LDPC codes; see `phy.kernels.ldpc` for the terms.

A block of Z ≤ 128 bits is two words, bit 0 lowest. The block shifted by s consists of the Z bits
from bit s on of the block written twice in sequence.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from phy.kernels.bits import ONE, Words, from_octets, get, low_ones
from phy.kernels.inline import step
from phy.kernels.local import local
from phy.kernels.openers import open_form
from phy.sizes import N_COLUMNS
from phy.tables.block import PackedArguments
from phy.tables.code import Form

_63 = np.uint64(63)


@step
def _repeat(low: np.uint64, high: np.uint64, z: int, out: Words) -> None:
    """Write the `z` bits of `low` and `high` twice in sequence to `out` `[5]`."""
    word, bit = z >> 6, np.uint64(z & 63)
    rest = _63 - bit
    for i in range(2, 5):
        out[i] = 0
    out[0], out[1] = low, high
    out[word] |= low << bit
    # Two shifts, because a single shift by 64 is undefined.
    out[word + 1] |= low >> ONE >> rest
    out[word + 1] |= high << bit
    out[word + 2] |= high >> ONE >> rest


@step
def _part(repeated: Words, first: int) -> np.uint64:
    """The 64 bits from bit `first` on of a repeated block."""
    word, bit = first >> 6, np.uint64(first & 63)
    part: np.uint64 = (repeated[word] >> bit) | (repeated[word + 1] << ONE << (_63 - bit))
    return part


@njit(nogil=True, cache=True, error_model="numpy")
def parity_of(bits: Words, form: Form, parity: Words) -> None:
    """Write the parity `[rows, 2]`, one row per block, of information `bits` `[K z / 64 + 1]`.

    Parity columns 1, 2, … form a staircase. Column 0 has three blocks: shift 1 in the first and
    last row, and shift 0 in row `middle`. Only the latter remains in the sum of all rows.
    """
    z, row_ends, columns, shifts = form.z, form.row_ends, form.columns, form.shifts
    n_rows = parity.shape[0]
    n_info = N_COLUMNS - n_rows
    low_mask, high_mask = low_ones(min(z, 64)), low_ones(max(z - 64, 0))
    repeated, sums = local(np.uint64, (n_info + 1, 5)), local(np.uint64, (n_rows, 2))
    for column in range(n_info):
        low = get(bits, column * z, min(z, 64))
        high = get(bits, column * z + 64, z - 64) if z > 64 else np.uint64(0)
        _repeat(low, high, z, repeated[column])
    first_low = first_high = np.uint64(0)
    for row in range(n_rows):
        low = high = np.uint64(0)
        for edge in range(row_ends[row], row_ends[row + 1]):
            column = columns[edge]
            # Parity columns are last in a row.
            if column >= n_info:
                break
            low ^= _part(repeated[column], shifts[edge])
            high ^= _part(repeated[column], shifts[edge] + 64)
        sums[row, 0], sums[row, 1] = low & low_mask, high & high_mask
        first_low ^= sums[row, 0]
        first_high ^= sums[row, 1]
    parity[0, 0], parity[0, 1] = first_low, first_high
    _repeat(first_low, first_high, z, repeated[n_info])
    # From row 0 down: parity column r + 1 completes row r.
    low = sums[0, 0] ^ (_part(repeated[n_info], 1) & low_mask)
    high = sums[0, 1] ^ (_part(repeated[n_info], 65) & high_mask)
    for row in range(1, n_rows):
        parity[row, 0], parity[row, 1] = low, high
        low ^= sums[row, 0]
        high ^= sums[row, 1]
        if row == form.middle:
            low ^= first_low
            high ^= first_high


@step
def unpack(words: Words, n: int, out: NDArray[np.uint8], at: int) -> None:
    """Write the first `n` bits of `words` to `out` from `at` on, one bit per element."""
    for i in range(n):
        out[at + i] = words[i >> 6] >> np.uint64(i & 63) & ONE


@njit(nogil=True, cache=True, error_model="numpy")
def encode_codeword(
    bits: Words, number: int, form: Form, parity: Words, out: NDArray[np.uint8], at: int
) -> None:
    """Write codeword `number` of a block, first `bits` and then parity, from `out[at]` on.

    `bits` are zero beyond the codeword's share of the block; `parity` `[rows, 2]` is working
    memory.
    """
    z, share = form.z, form.shares[number]
    n_parity = form.ends[number + 1] - form.ends[number] - share
    unpack(bits, share, out, at)
    parity_of(bits, form, parity)
    for row in range(parity.shape[0]):
        first = row * z
        unpack(parity[row], min(z, n_parity - first), out, at + share + first)


@njit(nogil=True, cache=True, error_model="numpy")
def encode_blocks(
    blocks: NDArray[np.uint8], form_in: PackedArguments, out: NDArray[np.uint8]
) -> None:
    """Write the coded bits `[blocks, n_coded]` of blocks of bits `[blocks, n_bits]` to `out`."""
    form = open_form(form_in)
    n_rows = form.row_ends.size - 1
    bits = local(np.uint64, (N_COLUMNS - n_rows) * form.z // 64 + 2)
    parity = local(np.uint64, (n_rows, 2))
    for block in range(blocks.shape[0]):
        at = 0
        for number in range(form.shares.size):
            share = form.shares[number]
            bits[:] = 0
            for i in range(share):
                bits[i >> 6] |= np.uint64(blocks[block, at + i]) << np.uint64(i & 63)
            at += share
            encode_codeword(bits, number, form, parity, out[block], int(form.ends[number]))


@njit(nogil=True, cache=True, error_model="numpy")
def encode_octets(
    octets: NDArray[np.uint8], n_blocks: int, form: Form, out: NDArray[np.uint8]
) -> None:
    """Write the coded bits of `n_blocks` blocks of bytes to `out`, one block after another."""
    n_rows, n_octets = form.row_ends.size - 1, octets.size // n_blocks
    whole = local(np.uint64, n_octets // 8 + 2)
    bits = local(np.uint64, (N_COLUMNS - n_rows) * form.z // 64 + 2)
    parity = local(np.uint64, (n_rows, 2))
    for block in range(n_blocks):
        at, to = 0, block * form.ends[-1]
        from_octets(octets[block * n_octets : (block + 1) * n_octets], whole)
        for number in range(form.shares.size):
            share = form.shares[number]
            bits[:] = 0
            for i in range(0, share, 64):
                bits[i >> 6] = get(whole, at + i, min(64, share - i))
            at += share
            encode_codeword(bits, number, form, parity, out, int(to + form.ends[number]))
