"""The channel is what the receiver knows of a burst's way; the simulated air is `phy.channel`."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from phy.reference.ofdm import Subcarriers

LEAST_NOISE = 1e-4
"""However strong a signal is, echoes and converters leave this share of it as noise."""


@dataclass
class Channel:
    """A channel holds gains, noise, and how well each group of the smoother is known.

    Gains are in the order of `grid.used`. A group's numbers are a variance and a power, each for
    one dimension of it; the last group is what is in no other.
    """

    h: Subcarriers
    """Ĥ, a gain for each subcarrier `[n_used]`."""
    no: float
    """N, the noise power on a subcarrier."""
    gain: float
    """The mean of |H|², without noise."""
    delay: float = 0.0
    """The mean phase of Ĥ from a subcarrier to the next, in radians."""
    unknown: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    """What is not known of each group `[groups + 1]`."""
    power: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    """What was found in each group `[groups + 1]`."""
    drift: float = 0.0
    """The channel moves by this share of its power from one correction to the next."""

    @property
    def noise(self) -> float:
        """The noise that LLRs count with is N, or the least there always is if that is more."""
        return max(self.no, LEAST_NOISE * self.gain)
