"""How much of the air others use, as far as they are heard."""

from math import inf


class AirHeard:
    """Airtime of others' bursts, each counted once, in s."""

    def __init__(self) -> None:
        self.heard_s = 0.0
        self._until = -inf

    def add(self, at: float, ended_at: float) -> None:
        """Add a PDU whose burst began at `at`, and whose own last sample came at `ended_at`."""
        self.heard_s += max(0.0, ended_at - max(at, self._until))
        self._until = max(self._until, ended_at)
