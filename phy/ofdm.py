"""Converts samples to subcarriers, with one FFT per symbol."""

import numpy as np
from numpy.typing import NDArray

from phy import compute
from phy.estimation import new_scratch, tones
from phy.numerology import Numerology
from phy.sizes import whole_lanes


def to_tones(
    samples: NDArray[np.complex64],
    starts: NDArray[np.int64],
    frequency: float,
    dc: complex,
    grid: Numerology,
    origin: int = 0,
) -> NDArray[np.float32]:
    """Tones `[n, 2, width]`, real and imaginary parts, of the FFT windows that begin at `starts`.

    First, `dc` is subtracted and the samples are rotated back by `frequency` cycles per sample,
    with phase 0 `origin` samples before `samples[0]`. A subcarrier sent as 1 arrives as 1 through a
    channel of gain 1.
    """
    out = np.empty((len(starts), 2, whole_lanes(grid.n_used)), np.float32)
    scratch = new_scratch(grid)
    compute.to_tones(samples, starts, frequency, dc, origin, tones(grid), scratch, out)
    return out
