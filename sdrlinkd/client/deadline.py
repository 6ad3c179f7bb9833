"""Points in time until which something is waited for."""

import math
import time

FOREVER = float("inf")


class Deadline:
    """A point in time `seconds` from now; None and infinity: never. Below 0 it has passed."""

    def __init__(self, seconds: float | None) -> None:
        self._at = FOREVER if seconds is None else time.monotonic() + seconds

    @property
    def left_s(self) -> float:
        """Seconds that are left; 0 when the deadline has passed."""
        return max(0.0, self._at - time.monotonic())

    @property
    def left_or_none(self) -> float | None:
        """Seconds that are left, for asyncio, where None waits for ever."""
        left_s = self.left_s
        return None if left_s == FOREVER else left_s

    @property
    def left_ms(self) -> int | None:
        """Milliseconds that are left, for ZeroMQ, where None waits for ever."""
        return milliseconds(self.left_s)


def milliseconds(seconds: float | None) -> int | None:
    """`seconds` in ms for ZeroMQ, where None waits for ever; never less, and never below 0."""
    if seconds is None or seconds == FOREVER:
        return None
    return max(0, math.ceil(seconds * 1000))
