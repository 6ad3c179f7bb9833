"""What the receiver knows of a burst's channel; the simulated air is `phy.channel`."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from phy.reference.ofdm import Subcarriers

LEAST_NOISE = 1e-4
"""Share of the signal that echoes and converters always leave as noise, however strong it is."""


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
    unknown: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    """The remaining variance of each group `[groups + 1]`."""
    power: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    """The power found in each group `[groups + 1]`."""
    drift: float = 0.0
    """The share of its power by which the channel moves from one correction to the next."""

    @property
    def noise(self) -> float:
        """The noise in LLRs: N, or at least the noise that the signal itself leaves."""
        return max(self.no, LEAST_NOISE * self.gain)
