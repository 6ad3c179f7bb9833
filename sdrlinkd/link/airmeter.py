"""Time on the air, of others."""


class AirMeter:
    """Air time of bursts that were heard, as far as their PDUs tell; in s."""

    def __init__(self) -> None:
        self.heard_s = 0.0
        self._counted_to = 0.0

    def note(self, at: float, ended_at: float) -> None:
        """A PDU of a burst that began at `at`; its own last sample came at `ended_at`."""
        self.heard_s += max(0.0, ended_at - max(at, self._counted_to))
        self._counted_to = max(self._counted_to, ended_at)
