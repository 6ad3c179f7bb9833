"""A separate clock for each end, derived from the one that all processes of this machine share."""

import time
from typing import NamedTuple


class Clock(NamedTuple):
    """clock = monotonic * (1 + ppm * 1e-6) + offset, in s."""

    offset_s: float
    ppm: float

    @property
    def rate(self) -> float:
        """Seconds of this clock per second of the machine."""
        return 1 + self.ppm * 1e-6

    def now(self) -> float:
        """The clock's current time in s."""
        return time.monotonic() * self.rate + self.offset_s

    def now_ns(self) -> int:
        """The clock's current time in ns, as messages for time synchronisation need it."""
        return round(self.now() * 1e9)
