"""A share of the air that something may take: repeats, questions, or routes."""

from math import inf

SAVED_S = 0.1
"""Most airtime in s that is saved up."""


class Budget:
    """Airtime that grows with time at a given share, and is spent before it is earned."""

    def __init__(self, share: float) -> None:
        self._share = share
        self._saved_s = SAVED_S
        self._at = 0.0

    @property
    def next_at(self) -> float:
        """When something may be spent next, by what was spent so far; −inf: at any time."""
        return -inf if self._saved_s > 0 else self._at - self._saved_s / self._share

    def free_at(self, now: float) -> float:
        """When something may be spent, at `now` or later."""
        return max(now, self.next_at)

    def spend(self, airtime_s: float, now: float, *, is_bounded: bool = False) -> None:
        """Spend airtime, in s; `is_bounded`: no more debt than what can be saved up."""
        self._earn(now)
        left_s = self._saved_s - airtime_s
        self._saved_s = max(left_s, min(-SAVED_S, self._saved_s)) if is_bounded else left_s

    def restart(self) -> None:
        """Go on with another clock."""
        self._at = 0.0

    def _earn(self, now: float) -> None:
        self._saved_s = min(SAVED_S, self._saved_s + self._share * max(0.0, now - self._at))
        self._at = max(self._at, now)
