"""Deadlines of waits, in the units that asyncio and ZeroMQ take."""

import math
import time

FOREVER = float("inf")


class Deadline:
    """A point in time `seconds` from now; None or infinity: never; negative: already passed."""

    def __init__(self, seconds: float | None) -> None:
        self._at = FOREVER if seconds is None else time.monotonic() + seconds

    @property
    def left_s(self) -> float:
        """Seconds left; 0 when the deadline has passed."""
        return max(0.0, self._at - time.monotonic())

    @property
    def left_or_none(self) -> float | None:
        """Seconds left, for asyncio, where None waits forever."""
        left_s = self.left_s
        return None if left_s == FOREVER else left_s

    @property
    def left_ms(self) -> int | None:
        """Milliseconds left, for ZeroMQ, where None waits forever."""
        return milliseconds(self.left_s)


def milliseconds(seconds: float | None) -> int | None:
    """`seconds` in whole ms for ZeroMQ, rounded up and at least 0; None waits forever."""
    if seconds is None or seconds == FOREVER:
        return None
    return max(0, math.ceil(seconds * 1000))
