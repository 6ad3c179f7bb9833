"""How a block of bits becomes codewords of a quasi-cyclic code, and the memory of decoding."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from phy.sizes import N_COLUMNS, N_LANES_INT16
from phy.tables.block import ArgumentBlock, block_of


@block_of("i8 i8 i4[1] i4[1] i4[1] i4[1] i4[1]")
class Form(NamedTuple):
    """A code, and how much of a block each codeword holds; see `phy.kernels.ldpc` for the terms."""

    z: int
    middle: int
    """The row in which the first parity column has its middle block."""
    row_ends: NDArray[np.int32]
    """Start of each block row's edges, and the end of the last row `[rows + 1]`."""
    columns: NDArray[np.int32]
    shifts: NDArray[np.int32]
    """Block column and shift of each edge, row by row `[edges]`."""
    shares: NDArray[np.int32]
    """Bits of the block in each codeword `[codewords]`."""
    ends: NDArray[np.int32]
    """Start of each codeword's coded bits, and the end of the last `[codewords + 1]`."""


@block_of("i2[1] i2[2] i2[2] i2[2] i2[2]")
class Workspace(NamedTuple):
    """Working memory of decoding; one per thread, because the kernels hold no lock."""

    llr: NDArray[np.int16]
    """LLRs of a whole codeword `[24 Z]`."""
    posteriors: NDArray[np.int16]
    messages: NDArray[np.int16]
    told: NDArray[np.int16]
    """What checks last received; `messages` is what they last sent.

    Both are `[edges, Z up to whole vectors]`.
    """
    scratch: NDArray[np.int16]


def new_workspace(max_z: int = 81, max_edges: int = 96) -> ArgumentBlock[Workspace]:
    """A workspace for codes with up to `max_z` bits per block and up to `max_edges` edges."""
    lanes = -(-max_z // N_LANES_INT16) * N_LANES_INT16
    return ArgumentBlock(
        Workspace(
            llr=np.zeros(N_COLUMNS * max_z, np.int16),
            posteriors=np.zeros((N_COLUMNS, 3 * lanes + 2 * N_LANES_INT16), np.int16),
            messages=np.zeros((max_edges, lanes), np.int16),
            told=np.zeros((max_edges, lanes), np.int16),
            scratch=np.zeros((N_COLUMNS, N_LANES_INT16), np.int16),
        )
    )
