"""Tables and working memory of the receiver's kernels.

Rows over tones have the length `width`: the tones in use, padded with zeros to whole lanes.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from phy.tables.block import block_of

Row = NDArray[np.float32]
Planes = NDArray[np.float32]
"""Real parts in one row, imaginary parts in the next, so that loops are vectorised."""


@block_of("i8 i8 f8 i8 i8[1] i8[1] f4[1] f4[1] f4[1] f4[2] i8[1] i8[2] f4[2]")
class Tones(NamedTuple):
    """A grid and its subcarriers in use, data first, then pilots `[n_used]`."""

    n_fft: int
    n_symbol: int
    gain: float
    """Factor for subcarriers of samples of mean power 1."""
    n_data: int
    bins: NDArray[np.int64]
    subcarriers: NDArray[np.int64]
    numbers: Row
    """`subcarriers` as float32 `[width]`."""
    pilots: Row
    """Pilots of a symbol with polarity +1 `[n_pilots]`."""
    polarity: Row
    """Sign of each symbol's pilots; the header's first symbol is number 0."""
    basis: NDArray[np.float32]
    """Orthonormal rows of the smoother `[n, width]`; see `phy.kernels.smoothing`."""
    ends: NDArray[np.int64]
    neighbors: NDArray[np.int64]
    twiddles: Planes
    """exp(−2πj m / n_fft) `[2, n_fft]`."""


@block_of("i8 i8 f8 u4[1]")
class Axes(NamedTuple):
    """A modulation: bits of each axis, half the level distance, position of each coded bit."""

    real_bits: int
    imag_bits: int
    unit: float
    gather: NDArray[np.uint32]
    """Position of each bit of the code's order in a symbol whose bits lie plane by plane."""


@block_of(
    "f4[2] f4[2] f4[2] f4[2] f4[2] f4[1] f4[2] f4[1] "
    "f8[2] f8[1] f8[1] f8[2] f8[2] f4[2] f4[1] f4[1]"
)
class Channel(NamedTuple):
    """What is known of a burst's channel; it is updated during the burst."""

    h: Planes
    """Gains `[2, width]`, in the order of `Tones`."""
    speed: Planes
    """Change of the gains from symbol to symbol `[2, width]`."""
    centre: Planes
    """Factors that rotate gains back by their mean delay `[2, width]`."""
    turns: Planes
    """Factors that rotate a symbol's subcarriers back by the slope in use `[2, width]`."""
    inverse: Planes
    """1 / h `[2, width]`; 0 for gains of 0."""
    certainty: Row
    """|h|² over the noise, in units of LLRs `[width]`."""
    sums: Planes
    masses: Row
    """Over the symbols since the last correction, Σ y (E s)* `[2, width]`, Σ E |s|² `[width]`."""
    unknown: NDArray[np.float64]
    """For each group of the smoother, what is not known of gain and speed `[3, groups + 1]`.

    Variance of a gain, covariance, variance of a speed, per dimension; see `phy.kernels.smoothing`.
    """
    power: NDArray[np.float64]
    """Mean power of each group `[groups + 1]`, per dimension."""
    figures: NDArray[np.float64]
    """Scalar values; their indices are defined below."""
    tracking: NDArray[np.float64]
    """State of both tracking filters `[2, 5]`; see `phy.kernels.tracking`."""
    missed: NDArray[np.float64]
    """By how much the last symbol's pilots differed, times their gains `[2, n_pilots]`."""
    kept: NDArray[np.float32]
    """0 for subcarriers that were cut before the FFT, else 1, for each symbol `[n, width]`.

    Row 0 also stands for the known symbols, as long as the channel is estimated.
    """
    whole: Row
    """Share of the samples of each symbol's FFT window that were not blanked `[n]`."""
    trust: Row
    """Noise of the preamble over that of each symbol `[n]`: 1, less under interference."""

    @property
    def no(self) -> float:
        """Noise power on a subcarrier, on the scale of the gains."""
        return float(self.figures[NO])

    @property
    def gain(self) -> float:
        """Mean power gain of the subcarriers, |h|²."""
        return float(self.figures[GAIN])


PHASE, SLOPE = 0, 1
"""Rows of `tracking`: the phase common to all tones, and its slope over them."""

N_FIGURES = 16
(
    NO, GAIN, DELAY, DRIFT, N_HEARD, CERTAIN, WRONG, SLOPE_USED, DOUBT, DUE, MOVES, SPREAD, SCALED,
    TURNS, N_FOLLOWED, N_ODD,
) = range(N_FIGURES)  # fmt: skip
"""Of `figures`: noise on a subcarrier, mean |h|², phase a subcarrier, drift; symbols since a
correction, what was certain in them, Σ |E s|², and what was not, Σ |h|² (E|s|² − |E s|²); the slope
that subcarriers are turned back by; mean variance of the gains; symbols from one correction to the
next; whether gains have a speed; variance of the common amplitude (0 until a step of it); its steps
since the estimate, as one; sum over symbols of the squared turn of echoes in a symbol, in rad², and
the number of these symbols."""


@block_of(
    "f4[2] i8[1] f4[2] f4[1] f4[3] f4[2] f4[1] i2[1] c16[1] f8[1] f4[2] f4[2] f4[2] f8[1] f8[2]"
)
class Scratch(NamedTuple):
    """Working memory of the receiver's kernels; one per thread."""

    windows: NDArray[np.float32]
    starts: NDArray[np.int64]
    turn: Planes
    """Room of the FFT.

    It has eight windows, twice `[4, 8 n_fft]`, their start indices `[8]`, and the factors that
    rotate them back `[2, n_fft]`.
    """
    square: Row
    """Eight by eight values to transpose."""
    y: NDArray[np.float32]
    """Tones of eight symbols `[8, 2, width]`."""
    level: Planes
    llr: Row
    planes: NDArray[np.int16]
    """A symbol's points, and its LLRs bit by bit."""
    turned: NDArray[np.complex128]
    pilot_power: NDArray[np.float64]
    """The pilots in the form that tracking takes `[n_pilots]`."""
    rest: Planes
    joined: Planes
    coefficients: NDArray[np.float32]
    energies: NDArray[np.float64]
    weights: NDArray[np.float64]
    """Room of the smoother.

    Twice `[2, width]`, then `[2, rows of the basis]`, `[groups + 1]`, `[2, groups + 1]`.
    """
