"""What kernels of the receiver are told, and what they keep between calls."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Row = NDArray[np.float32]
Planes = NDArray[np.float32]
"""Real parts in one row, imaginary ones in the next, so that loops are vectorised."""


class Tones(NamedTuple):
    """The carriers in use, data first, then pilots; all `[n_used]` unless said."""

    bins: NDArray[np.int64]
    carriers: NDArray[np.int64]
    n_data: int
    pilots: NDArray[np.float32]
    """Of a symbol with polarity +1 `[n_pilots]`."""
    basis: NDArray[np.float32]
    """Rows of `phy.kernels.smoothing` `[n, n_used]`."""
    ends: NDArray[np.int64]
    neighbours: NDArray[np.int64]


class Axes(NamedTuple):
    """Modulation: bits of each axis, half the distance of levels, where each coded bit lies."""

    real_bits: int
    imag_bits: int
    unit: float
    gather: NDArray[np.int32]
    """Place of each bit of the code's order, when a symbol's bits lie plane by plane."""


class Channel(NamedTuple):
    """What is known of a burst's channel; it changes while the burst is heard."""

    h_hat: NDArray[np.complex64]
    """Gains `[n_used]`, in the order of `Tones`."""
    unknown: NDArray[np.float64]
    power: NDArray[np.float64]
    """`[groups + 1]`: see `phy.kernels.smoothing`."""
    sums: Planes
    masses: Row
    """Over the symbols since the last correction, Σ y (E s)* `[2, n_used]`, Σ E |s|² `[n_used]`."""
    figures: NDArray[np.float64]
    """See the indices below."""
    tracking: NDArray[np.float64]
    """See `phy.kernels.tracking` `[2, 5]`."""

    @property
    def no(self) -> float:
        """Noise power on a carrier."""
        return float(self.figures[NO])

    @property
    def gain(self) -> float:
        """Mean |h|²."""
        return float(self.figures[GAIN])


N_FIGURES = 7
NO, GAIN, DELAY, DRIFT, N_HEARD, CERTAIN, SLOPE_USED = range(N_FIGURES)
"""Of `figures`: noise on a carrier, mean |h|², phase a carrier, drift; symbols since a correction
and what was certain in them, Σ |E s|²; the slope that carriers are turned back by."""
