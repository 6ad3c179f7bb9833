"""Level of the samples that a radio receives, and whether they clip."""

import numpy as np

from backends.base import Levels, Samples

EVERY = 16
"""One block in this many is measured; that costs almost nothing."""
KEEPS = 0.98
"""Weight of the past in each new mean; a mean covers several hundred blocks."""
FULL = 0.99
"""Magnitude from which an I or Q value counts as clipped."""


class LevelMeter:
    """Measures blocks as they come from the radio; written by one thread, readable from any."""

    def __init__(self) -> None:
        self._blocks = 0
        self._power = self._clipped = 0.0
        self._weight = 0.0

    def push(self, samples: Samples) -> None:
        """Measure this block, if its turn has come."""
        self._blocks += 1
        if self._blocks % EVERY or not len(samples):
            return
        parts = np.abs(samples.view(np.float32))
        power = 2 * float(np.dot(parts, parts)) / len(parts)
        clipped = float(np.count_nonzero(parts >= FULL)) / len(parts)
        self._weight = KEEPS * self._weight + (1 - KEEPS)
        self._power = KEEPS * self._power + (1 - KEEPS) * power
        self._clipped = KEEPS * self._clipped + (1 - KEEPS) * clipped

    @property
    def levels(self) -> Levels | None:
        """The latest measurement; None before the first."""
        weight, power = self._weight, self._power
        if not weight:
            return None
        return Levels(10 * float(np.log10(max(power / weight, 1e-30))), self._clipped / weight)
