"""Layered min-sum decoder of quasi-cyclic LDPC codes.

The parity-check matrix is made of Z x Z blocks, each zero or a shifted identity. So the Z checks of
a block row are independent, and each takes one bit of every block column it touches: from block
column c with shift s, check z takes bit (z + s) mod Z. Z checks at a time are Z lanes of a vector.

*Layers.* The decoder keeps a posterior LLR of each bit, and of each edge (check, bit) the message
the check last sent. It visits one block row after another; a row takes its old messages off the
posteriors, forms new ones from what is left, and adds them at once, so that the next row already
knows (Hocevar 2004).

*Min-sum.* A check sends to each of its bits the product of the signs and the least magnitude of all
its other bits. That is the least magnitude of all, and for the bit that has it the second least:
two minima and one product of signs serve all edges. The minimum is an overestimate, so messages
are taken times 13/16 (Chen and Fossorier 2002), to the nearest: at rate 1/2 both 3/4 and rounding
up lose more blocks.

*Rotation.* Each block column of posteriors is stored as a periodic sequence that goes on for a
vector or more beyond Z. Then Z lanes from any shift on are contiguous in memory; lanes past Z hold
exact copies of the first, and compute the same. After a row, what it has written is copied to the
places Z before and behind.

*Vectors.* A row is written as LLVM vector instructions (`ldpc_rows.py`, which says why).
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from phy.kernels.ldpc_rows import LANES, ldpc_row

N_COLUMNS = 24
SURE = 4000
"""LLR of a bit that is known to be 0."""


class LdpcWorkspace:
    """What decoding needs besides its input. One for each thread: the kernels hold no lock."""

    def __init__(self, max_z: int = 81, max_edges: int = 96) -> None:
        lanes = padded(max_z)
        self.posteriors = np.zeros((N_COLUMNS, 3 * lanes + 2 * LANES), np.int16)
        self.messages = np.zeros((max_edges, lanes), np.int16)
        self.scratch = np.zeros((N_COLUMNS, LANES), np.int16)
        self.llr = np.zeros(N_COLUMNS * max_z, np.int16)


def padded(z: int) -> int:
    """Z, up to whole vectors."""
    return -(-z // LANES) * LANES


@njit(nogil=True, cache=True)
def decode_codeword(
    llr: NDArray[np.int16],
    z: int,
    row_ends: NDArray[np.int32],
    columns: NDArray[np.int32],
    shifts: NDArray[np.int32],
    max_iterations: int,
    posteriors: NDArray[np.int16],
    messages: NDArray[np.int16],
    scratch: NDArray[np.int16],
) -> int:
    """Iterations until all checks held, 0 if they never did; the bits are posteriors' signs.

    `llr` `[24 z]`, positive for 0; edges `columns`, `shifts` `[edges]`, of row r up to
    `row_ends[r + 1]`.
    """
    lanes = -(-z // LANES) * LANES
    for column in range(N_COLUMNS):
        for i in range(z):
            posteriors[column, i] = llr[column * z + i]
        for i in range(z, 2 * lanes):
            posteriors[column, i] = posteriors[column, i - z]
    messages[:] = 0
    for iteration in range(max_iterations):
        odd = 0
        for row in range(row_ends.size - 1):
            first, last = np.int64(row_ends[row]), np.int64(row_ends[row + 1])
            odd |= ldpc_row(posteriors, messages, scratch, columns, shifts, first, last, z)
        if odd == 0:
            return iteration + 1
    return 0


@njit(nogil=True, cache=True)
def decode_blocks(
    llr: NDArray[np.int16],
    z: int,
    row_ends: NDArray[np.int32],
    columns: NDArray[np.int32],
    shifts: NDArray[np.int32],
    shares: NDArray[np.int32],
    ends: NDArray[np.int32],
    max_iterations: int,
    whole: NDArray[np.int16],
    posteriors: NDArray[np.int16],
    messages: NDArray[np.int16],
    scratch: NDArray[np.int16],
    out: NDArray[np.uint8],
) -> None:
    """The other way round, packed in bytes: `out` `[blocks, n_bits / 8]`.

    What was not sent is known to be 0 (information) or not at all.
    """
    n_info = (N_COLUMNS - (row_ends.size - 1)) * z
    codeword = whole[: N_COLUMNS * z]
    decided = np.empty(8 * out.shape[1], np.uint8)
    for block in range(llr.shape[0]):
        at = 0
        for number in range(shares.size):
            share = shares[number]
            middle_at = ends[number] + share
            n_parity = ends[number + 1] - middle_at
            codeword[:share] = llr[block, ends[number] : middle_at]
            codeword[share:n_info] = SURE
            codeword[n_info : n_info + n_parity] = llr[block, middle_at : ends[number + 1]]
            codeword[n_info + n_parity :] = 0
            decode_codeword(
                codeword, z, row_ends, columns, shifts, max_iterations,
                posteriors, messages, scratch,
            )  # fmt: skip
            for column in range(-(-share // z)):
                first = column * z
                bits = decided[at + first : at + min(first + z, share)]
                for i in range(bits.size):
                    bits[i] = posteriors[column, i] < 0
            at += share
        _pack(decided, out[block])


@njit(nogil=True, cache=True)
def _pack(bits: NDArray[np.uint8], out: NDArray[np.uint8]) -> None:
    """As `np.packbits`."""
    for i in range(out.size):
        octet = np.uint32(0)
        for b in range(8):
            octet |= np.uint32(bits[8 * i + b]) << np.uint32(7 - b)
        out[i] = np.uint8(octet)
