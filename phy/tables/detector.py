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

# Content of the state of the search: DC; number of hops; the power that noise seems to have (0:
# unknown); how many hops with that power were searched in vain, up to PATIENCE; and how many with
# more power were, one after another.
DC_REAL, DC_IMAG, HOPS, FLOOR, SURE, ABOVE = range(6)
N_STATE = 6

PATIENCE = 4096
"""A power is that of noise once so many hops were searched in vain."""
LOWER = 0.7
"""A hop, or the noise of a burst, with less than this share of the floor: it was not noise."""


@block_of("f8[1] f4[2]")
class SearchMemory(NamedTuple):
    """What the search keeps from call to call, and its working memory."""

    state: NDArray[np.float64]
    """DC, and what is known of the noise `[N_STATE]`."""
    work: NDArray[np.float32]
    """Room for the sums of as many samples as are searched at once `[7, HISTORY + n]`."""

    @property
    def dc(self) -> complex:
        """The DC that a search has estimated."""
        return complex(self.state[DC_REAL], self.state[DC_IMAG])

    def heard(self, noise: float) -> None:
        """Note a burst that was read beside `noise`: signals are on the air, and no more noise."""
        self.state[ABOVE] = 0
        if noise < LOWER * self.state[FLOOR]:
            self.state[SURE] = 0


def new_search_memory(hop: int) -> ArgumentBlock[SearchMemory]:
    """Memory of a search that begins, in hops of `hop` samples."""
    work = np.zeros((7, HISTORY + hop), np.float32)
    return ArgumentBlock(SearchMemory(state=np.zeros(N_STATE), work=work))
