"""Tables and working memory of acquisition; see `phy.kernels.acquisition`."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from phy.tables.block import block_of
from phy.tables.burst import Planes, Row

SEARCH = 24
"""The search for the first long symbol covers this many samples around its nominal place."""
# In cycles per sample: the detector's peak, over segments of 16 samples, gives the frequency modulo
# this.
AMBIGUITY = 1 / 16
BACKOFF = 3
"""Number of samples before the first echo at which FFT windows begin."""
SEGMENT = 16
"""Number of samples of a segment of the short training."""
# First samples of a short segment that echoes of the previous segment hardly reach.
FIRST_CLEAN = BACKOFF + 4
N_CLEAN = SEGMENT - 4
PART = 16
"""Number of samples of the long training whose phase is evaluated together."""
N_LONG = 2
"""Number of symbols in the long training."""


@block_of("c8[2] f4[3] f4[3] f4[1] f8[1] f4[3] i8[1]")
class Training(NamedTuple):
    """Tables about the preamble and the header on one grid, for acquisition."""

    templates: NDArray[np.complex64]
    """The long symbol, shifted by each multiple of 1/16 to try `[2 aliases + 1, n_fft]`."""
    long: NDArray[np.float32]
    """The long training as sent `[2, 2, width]`."""
    waves: NDArray[np.float32]
    """Each tone of the preamble in time, `[n_used, 2, 16 + n_fft]`.

    A row holds the clean samples of a short segment, then zeros, then the long symbol.
    """
    cover: Row
    frequencies: NDArray[np.float64]
    """Frequency corrections to try, in cycles per sample, evenly spaced."""
    turns: NDArray[np.float32]
    """Factors that rotate each preamble part back by `frequencies`.

    The shape is `[n_parts, 2, n_frequencies]`.
    """
    windows: NDArray[np.int64]
    """First samples of the FFT windows of the long training and the header."""


@block_of("f4[2] f4[2] f4[2] f4[3] c8[2] i2[1] i2[1] u8[1] u1[1]")
class Room(NamedTuple):
    """Working memory and results of acquisition; one per thread."""

    planes: Planes
    """The burst's samples up to the end of its header, rotated back."""
    wave: Planes
    """The preamble after the channel, laid out like a row of `Training.waves`."""
    parts: Planes
    """Correlation of the preamble's parts with `wave` `[2, n_parts]`."""
    y: NDArray[np.float32]
    """Long training and header `[2 + n_header, 2, width]`."""
    points: NDArray[np.complex64]
    """The header's equalised points `[n_header, n_data]`."""
    llr: NDArray[np.int16]
    """LLRs of the header's coded bits, including repetitions `[n_header · n_data]`."""
    folded: NDArray[np.int16]
    """LLRs of the header's coded bits, with repetitions added up `[2 (32 + 6)]`."""
    decisions: NDArray[np.uint64]
    octets: NDArray[np.uint8]
    """The likeliest header, with its check sum `[4]`."""
