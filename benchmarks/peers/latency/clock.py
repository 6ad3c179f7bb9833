"""A clock of its own for each end, made of the one that all processes of this machine share."""

import time
from typing import NamedTuple


class Clock(NamedTuple):
    """clock = monotonic * (1 + ppm * 1e-6) + offset, in s."""

    offset_s: float
    ppm: float

    @property
    def rate(self) -> float:
        """Its seconds in one of the machine's."""
        return 1 + self.ppm * 1e-6

    def now(self) -> float:
        """What this clock shows now, in s."""
        return time.monotonic() * self.rate + self.offset_s

    def now_ns(self) -> int:
        """In whole ns, as time synchronisation's messages have it."""
        return round(self.now() * 1e9)
