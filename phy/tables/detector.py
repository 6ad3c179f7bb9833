"""Sizes and state of the search for preambles; see `phy.kernels.detector`."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from phy.tables.block import ArgumentBlock, block_of

SEGMENT = 16
SHORT = 192
HISTORY = SHORT - 1
"""Number of samples before a sample that its metric needs."""

FORGETS = 4096.0
"""Number of samples in which a raised threshold decays by a factor of e."""

# Content of the state of the search: DC, number of hops, and the power of the noise; 0: unknown.
DC_REAL, DC_IMAG, HOPS, FLOOR = range(4)
N_STATE = 4


@block_of("f8[1] f4[2]")
class SearchMemory(NamedTuple):
    """What the search keeps from call to call, and its working memory."""

    state: NDArray[np.float64]
    """Estimates of DC and noise `[N_STATE]`."""
    work: NDArray[np.float32]
    """Room for the sums of as many samples as are searched at once `[7, HISTORY + n]`."""

    @property
    def dc(self) -> complex:
        """The DC that a search has estimated."""
        return complex(self.state[DC_REAL], self.state[DC_IMAG])


def new_search_memory(hop: int) -> ArgumentBlock[SearchMemory]:
    """Memory of a search that begins, in hops of `hop` samples."""
    work = np.zeros((7, HISTORY + hop), np.float32)
    return ArgumentBlock(SearchMemory(state=np.zeros(N_STATE), work=work))
