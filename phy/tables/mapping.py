"""The tables of a modulation, from coded bits to points."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from phy.tables.block import block_of
from phy.tables.burst import Row


@block_of("i8 u4[1] f4[1] f4[1]")
class Map(NamedTuple):
    """A modulation on a grid, as tables from coded bits to points."""

    bits: int
    source: NDArray[np.uint32]
    """Index of the coded bit for each subcarrier bit, highest first `[n_data · bits]`."""
    real: Row
    imag: Row
    """Coordinates of the points, indexed by their bits as a number."""
