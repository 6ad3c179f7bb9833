"""What the receiver knows of a burst's channel; the simulated air is `phy.channel`."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from phy.reference.ofdm import Subcarriers

LEAST_NOISE = 1e-4
"""Share of the signal that echoes and converters always leave as noise, however strong it is."""

LONGEST = 8
"""The number of symbols from one correction of a channel that stands still to the next."""


@dataclass
class Channel:
    """A channel: gains, noise, and the uncertainty of each group of the smoother.

    Gains are in the order of `grid.used`. Each group has a variance and a power, both per
    dimension; the last group holds everything outside the others.
    """

    h: Subcarriers
    """Ĥ, the gain of each subcarrier `[n_used]`."""
    no: float
    """N, the noise power on a subcarrier."""
    gain: float
    """The mean of |H|², without noise."""
    delay: float = 0.0
    """The mean phase of Ĥ from one subcarrier to the next, in radians."""
    speed: Subcarriers = field(default_factory=lambda: np.zeros(0, np.complex128))
    """The change of Ĥ from symbol to symbol `[n_used]`."""
    moves: bool = False
    """Whether there may be a speed."""
    unknown: NDArray[np.float64] = field(default_factory=lambda: np.zeros((3, 0)))
    """What is not known of each group's gain and speed `[3, groups + 1]`, per dimension.

    The variance of the gain, the covariance, the variance of the speed.
    """
    power: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    """The power found in each group `[groups + 1]`."""
    drift: float = 0.0
    """The variance of a change of the speed from symbol to symbol, as a share of the power."""
    doubt: float = 0.0
    """The mean variance of the gains."""
    spread: float = 0.0
    """The variance of the common amplitude, as a share of it; 0 until a step of it."""
    scaled: float = 1.0
    """The steps of the amplitude since the channel was estimated, as one."""
    turns: float = 0.0
    """The sum over symbols of the squared turn of echoes in a symbol, in rad²."""
    n_followed: int = 0
    """The number of these symbols."""
    n_odd: int = 0
    """The number of symbols, up to the last, that were of another burst, by their pilots."""
    due: int = LONGEST
    """The number of symbols from one correction to the next."""

    @property
    def noise(self) -> float:
        """The noise in LLRs: N, or at least the noise that the signal itself leaves."""
        return max(self.no, LEAST_NOISE * self.gain)
