"""Layered min-sum decoder of quasi-cyclic LDPC codes.

The parity-check matrix consists of Z x Z blocks, each zero or a shifted identity. So the Z checks
of a block row are independent, and each takes one bit of every block column it touches: from block
column c with shift s, check z takes bit (z + s) mod Z. Z checks at a time are Z lanes of a vector.

*Layers.* The decoder keeps a posterior LLR for each bit, and for each edge (check, bit) the check's
last message. It visits one block row after another. A row subtracts its old messages from the
posteriors, forms new ones from the rest, and adds them at once, so that the next row already uses
them (Hocevar 2004).

*Min-sum.* A check sends to each of its bits the product of the signs and the least magnitude of all
its other bits. That is the least magnitude of all, or the second least for the bit that has the
least: two minima and one product of signs serve all edges. The minimum is an overestimate, so
messages are multiplied by 14/16 (Chen and Fossorier 2002) and rounded.

*Doubts.* If a bit's message to a check has changed its sign since the last one, it counts as 0 this
time (Savin 2008). Fewer blocks diverge, and those that do recover sooner.

*Rotation.* Each block column of posteriors is stored as a periodic sequence that continues for a
vector or more beyond Z. Then Z lanes from any shift on are contiguous in memory; lanes beyond Z
hold exact copies of the first lanes and compute the same. After a row, its results are copied to
the positions Z before and after.

*Shortcut.* On a good link the signs of a codeword's LLRs are already a codeword, the likeliest
there is. So the information bits are encoded first, which is cheap, and the parity is compared.

*Vectors.* A row is written as LLVM vector instructions; `ldpc_rows.py` explains why.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from phy.kernels.bits import Words, get, low_ones, put, put_signs, to_octets
from phy.kernels.ldpc_encoder import parity_of
from phy.kernels.ldpc_rows import LANES, ldpc_row
from phy.kernels.local import local
from phy.kernels.openers import open_form, open_workspace
from phy.sizes import N_COLUMNS
from phy.tables.block import PackedArguments
from phy.tables.code import Form, Workspace

SURE = 4000
"""LLR of a bit that is known to be 0."""


@njit(nogil=True, cache=True, error_model="numpy")
def decode_codeword(
    llr: NDArray[np.int16], form: Form, max_iterations: int, work: Workspace
) -> int:
    """Decode one codeword; returns the iterations until all checks held, 0 if they never did.

    `llr` `[24 z]` is positive for 0. The decoded bits are the signs of `work.posteriors`.
    """
    z, row_ends, posteriors = form.z, form.row_ends, work.posteriors
    lanes = -(-z // LANES) * LANES
    for column in range(N_COLUMNS):
        for i in range(z):
            posteriors[column, i] = llr[column * z + i]
        for i in range(z, 2 * lanes):
            posteriors[column, i] = posteriors[column, i - z]
    work.messages[:] = 0
    work.told[:] = 0
    for iteration in range(max_iterations):
        odd = 0
        for row in range(row_ends.size - 1):
            odd |= ldpc_row(
                posteriors, work.messages, work.told, work.scratch, form.columns, form.shifts,
                np.int64(row_ends[row]), np.int64(row_ends[row + 1]), z,
            )  # fmt: skip
        if odd == 0:
            return iteration + 1
    return 0


@njit(nogil=True, cache=True, error_model="numpy")
def decode_blocks(
    llr: NDArray[np.int16],
    max_iterations: int,
    form_in: PackedArguments,
    work_in: PackedArguments,
    white: NDArray[np.uint8],
    out: NDArray[np.uint8],
) -> None:
    """Decode LLRs of consecutive blocks to bytes `[blocks, bytes]`, XORed with `white`.

    An information bit that was not sent is known to be 0 (shortened); a parity bit that was not
    sent is unknown (punctured).
    """
    form, work = open_form(form_in), open_workspace(work_in)
    z, shares, ends = form.z, form.shares, form.ends
    n_rows = form.row_ends.size - 1
    n_info = (N_COLUMNS - n_rows) * z
    codeword = work.llr[: N_COLUMNS * z]
    bits, sent = local(np.uint64, n_info // 64 + 2), local(np.uint64, n_rows * z // 64 + 2)
    parity = local(np.uint64, (n_rows, 2))
    decided = local(np.uint64, out.shape[1] // 8 + 2)
    for block in range(out.shape[0]):
        at, first_llr = 0, block * ends[-1]
        decided[:] = 0
        for number in range(shares.size):
            share, begin, end = shares[number], first_llr + ends[number], ends[number + 1]
            middle, end = begin + share, first_llr + end
            bits[:] = 0
            put_signs(llr, begin, share, bits, 0)
            sent[:] = 0
            put_signs(llr, middle, end - middle, sent, 0)
            parity_of(bits, form, parity)
            if not _begins_with(parity, sent, z, end - middle):
                for i in range(share):
                    codeword[i] = llr[begin + i]
                codeword[share:n_info] = SURE
                for i in range(end - middle):
                    codeword[n_info + i] = llr[middle + i]
                codeword[n_info + end - middle :] = 0
                decode_codeword(codeword, form, max_iterations, work)
                bits[:] = 0
                for column in range(-(-share // z)):
                    first = column * z
                    put_signs(work.posteriors[column], 0, min(z, share - first), bits, first)
            for i in range(0, share, 64):
                put(decided, at + i, bits[i >> 6], min(64, share - i))
            at += share
        to_octets(decided, out[block])
        for i in range(out.shape[1]):
            out[block, i] ^= white[block * out.shape[1] + i]


@njit(nogil=True, cache=True, error_model="numpy")
def _begins_with(parity: Words, sent: Words, z: int, n: int) -> bool:
    """Whether the parity `[rows, 2]`, block after block, begins with the `n` bits `sent`."""
    different = np.uint64(0)
    for row in range(parity.shape[0]):
        first = row * z
        low = max(0, min(z, 64, n - first))
        high = max(0, min(z - 64, n - first - 64))
        if low:
            different |= (parity[row, 0] & low_ones(low)) ^ get(sent, first, low)
        if high:
            different |= (parity[row, 1] & low_ones(high)) ^ get(sent, first + 64, high)
    return bool(different == 0)
