"""What kernels of the receiver are told, and what they keep between calls.

Rows over tones are as long as `width`: the tones in use, up to whole lanes, zeros behind.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from phy.kernels.argument_block import opener

Row = NDArray[np.float32]
Planes = NDArray[np.float32]
"""Real parts in one row, imaginary ones in the next, so that loops are vectorised."""


class Tones(NamedTuple):
    """A grid, and its subcarriers in use, data first, then pilots `[n_used]`."""

    n_fft: int
    n_symbol: int
    gain: float
    """What subcarriers of samples of mean power 1 are taken times."""
    n_data: int
    bins: NDArray[np.int64]
    subcarriers: NDArray[np.int64]
    numbers: Row
    """`subcarriers` as float32 `[width]`."""
    pilots: Row
    """Pilots of a symbol with polarity +1 `[n_pilots]`."""
    polarity: Row
    """Sign of each symbol's pilots, the header's first symbol being number 0."""
    basis: NDArray[np.float32]
    """Orthonormal rows of the smoother, `phy.kernels.smoothing` `[n, width]`."""
    ends: NDArray[np.int64]
    neighbours: NDArray[np.int64]
    twiddles: Planes
    """exp(−2πj m / n_fft) `[2, n_fft]`."""


open_tones = opener(Tones, "i8 i8 f8 i8 i8[1] i8[1] f4[1] f4[1] f4[1] f4[2] i8[1] i8[2] f4[2]")


class Axes(NamedTuple):
    """A modulation: bits of each axis, half the distance of levels, where each coded bit lies."""

    real_bits: int
    imag_bits: int
    unit: float
    gather: NDArray[np.uint32]
    """Place of each bit of the code's order, when a symbol's bits lie plane by plane."""


open_axes = opener(Axes, "i8 i8 f8 u4[1]")


class Channel(NamedTuple):
    """What is known of a burst's channel; it changes while the burst is heard."""

    h: Planes
    """Gains `[2, width]`, in the order of `Tones`."""
    centre: Planes
    """What turns gains back by their mean delay `[2, width]`."""
    turns: Planes
    """What turns a symbol's subcarriers back by the slope that is used `[2, width]`."""
    inverse: Planes
    """1 / h `[2, width]`; 0 where nothing arrives."""
    certainty: Row
    """|h|² over the noise, in units of LLRs `[width]`."""
    sums: Planes
    masses: Row
    """Over the symbols since the last correction, Σ y (E s)* `[2, width]`, Σ E |s|² `[width]`."""
    unknown: NDArray[np.float64]
    power: NDArray[np.float64]
    """`[groups + 1]`: see `phy.kernels.smoothing`."""
    figures: NDArray[np.float64]
    """See the indices below."""
    tracking: NDArray[np.float64]
    """See `phy.kernels.tracking` `[2, 5]`."""

    @property
    def no(self) -> float:
        """Noise power on a subcarrier, on the scale of the gains."""
        return float(self.figures[NO])

    @property
    def gain(self) -> float:
        """Mean power gain of the subcarriers, |h|²."""
        return float(self.figures[GAIN])


open_channel = opener(Channel, "f4[2] f4[2] f4[2] f4[2] f4[1] f4[2] f4[1] f8[1] f8[1] f8[1] f8[2]")

N_FIGURES = 7
NO, GAIN, DELAY, DRIFT, N_HEARD, CERTAIN, SLOPE_USED = range(N_FIGURES)
"""Of `figures`: noise on a subcarrier, mean |h|², phase a subcarrier, drift; symbols since a
correction and what was certain in them, Σ |E s|²; the slope that subcarriers are turned back by."""


class Scratch(NamedTuple):
    """Working memory of the receiver's kernels: one for each thread."""

    windows: NDArray[np.float32]
    starts: NDArray[np.int64]
    turn: Planes
    """Room of the FFT: eight windows, twice `[4, 8 n_fft]`, where they begin `[8]`, and what turns
    them back `[2, n_fft]`."""
    square: Row
    """Eight by eight values, to be transposed."""
    y: NDArray[np.float32]
    """Tones of eight symbols `[8, 2, width]`."""
    level: Planes
    llr: Row
    planes: NDArray[np.int16]
    """A symbol's points, and its LLRs bit by bit."""
    turned: NDArray[np.complex128]
    pilot_power: NDArray[np.float64]
    """The pilots as tracking takes them `[n_pilots]`."""
    rest: Planes
    coefficients: NDArray[np.float32]
    energies: NDArray[np.float64]
    weights: NDArray[np.float64]
    """Room of the smoother `[2, width]`, `[2, rows of the basis]`, `[groups + 1]` twice."""


open_scratch = opener(
    Scratch, "f4[2] i8[1] f4[2] f4[1] f4[3] f4[2] f4[1] i2[1] c16[1] f8[1] f4[2] f4[2] f8[1] f8[1]"
)
