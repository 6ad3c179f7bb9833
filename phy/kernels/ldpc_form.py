"""How a block of bits becomes codewords of a quasi-cyclic code."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from phy.kernels.argument_block import opener

N_COLUMNS = 24
"""Block columns of a code."""


class Form(NamedTuple):
    """A code, and how much of a block is in each codeword; see `phy.kernels.ldpc` for the terms."""

    z: int
    middle: int
    """The row in which the first parity column has its block between the outer two."""
    row_ends: NDArray[np.int32]
    """Where the edges of each block row begin, and after the last row `[rows + 1]`."""
    columns: NDArray[np.int32]
    shifts: NDArray[np.int32]
    """Block column and shift of each edge, row by row `[edges]`."""
    shares: NDArray[np.int32]
    """Bits of the block in each codeword `[codewords]`."""
    ends: NDArray[np.int32]
    """Where the coded bits of each codeword begin, and after the last `[codewords + 1]`."""


open_form = opener(Form, "i8 i8 i4[1] i4[1] i4[1] i4[1] i4[1]")
