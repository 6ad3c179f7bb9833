"""Measures the airtime of bursts heard from others."""

from math import inf


class AirHeard:
    """Total airtime in s of bursts heard from others, each counted once."""

    def __init__(self) -> None:
        self.heard_s = 0.0
        self._until = -inf

    def add(self, at: float, ended_at: float) -> None:
        """Add a PDU whose burst began at `at`, and whose last sample came at `ended_at`."""
        self.heard_s += max(0.0, ended_at - max(at, self._until))
        self._until = max(self._until, ended_at)
