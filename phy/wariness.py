"""How much false alarms raise the detection threshold."""

import math

from phy.tables.detector import FORGETS

THRESHOLD = 0.25
MOST = 0.5
"""Limit for thresholds raised by false alarms: a burst as strong as all else together."""
# Amount by which a false alarm raises the threshold.
_WARIER = 0.1


class Wariness:
    """The excess over THRESHOLD, which decays: the source of a false alarm may return."""

    def __init__(self, start: int) -> None:
        self.excess = 0.0
        """The excess at index `raised_at`."""
        self.raised_at = start

    def false_alarm(self, index: int) -> None:
        """Raise the threshold after a false alarm at `index`."""
        left = self.excess * math.exp((self.raised_at - index) / FORGETS)
        self.excess = min(left + _WARIER, MOST - THRESHOLD)
        self.raised_at = index
