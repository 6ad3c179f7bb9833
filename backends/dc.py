"""Removes the DC offset that a receiver's own oscillator leaves at 0 Hz."""

import numpy as np

from backends.base import Samples

FOLLOWS = 0.02
"""Weight of each block's mean in the DC estimate."""


class DcBlocker:
    """Subtracts a slow mean. OFDM has no subcarrier at 0 Hz, so no signal is lost."""

    def __init__(self) -> None:
        self._mean: np.complex64 | None = None

    def push(self, samples: Samples) -> Samples:
        """Return the next block without DC, in memory of its own."""
        mean = samples.mean(dtype=np.complex64)
        if self._mean is None:
            self._mean = mean
        self._mean = np.complex64(self._mean + FOLLOWS * (mean - self._mean))
        clean: Samples = samples - self._mean
        return clean
