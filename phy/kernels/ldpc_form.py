"""How a block of bits becomes codewords of a quasi-cyclic code."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from phy.kernels.argument_block import opener


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


open_form = opener(Form, "i8 i8 i4[1] i4[1] i4[1] i4[1] i4[1]")
