"""Limits the rate of log lines by subject, for conditions that change all day."""

from dataclasses import dataclass
from typing import Generic, TypeVar

T = TypeVar("T")

MOST = 4
"""Most lines on one subject in a row."""
REFILL_S = 15.0
"""Time in s after which one more line on a subject is allowed."""


@dataclass(slots=True)
class _Subject:
    tokens: float
    at: float
    untold: int = 0
    last: object = None


class Limiter(Generic[T]):
    """Limits lines by subject; the last suppressed line is logged later, with their number."""

    def __init__(self) -> None:
        self._subjects: dict[str, _Subject] = {}

    def take(self, subject: str, line: T, now: float) -> T | None:
        """`line` if it may be logged now; None if it is held back."""
        known = self._refilled(subject, now)
        if known.tokens >= 1 and not known.untold:
            known.tokens -= 1
            return line
        known.untold += 1
        known.last = line
        return None

    def late(self, now: float) -> list[tuple[T, int]]:
        """Held-back lines that may be logged now, each with the number of lines it replaces."""
        told = []
        for subject, known in self._subjects.items():
            if known.untold and self._refilled(subject, now).tokens >= 1:
                known.tokens -= 1
                told.append((known.last, known.untold - 1))
                known.untold, known.last = 0, None
        return told  # type: ignore[return-value]

    def _refilled(self, subject: str, now: float) -> _Subject:
        known = self._subjects.setdefault(subject, _Subject(MOST, now))
        known.tokens = min(MOST, known.tokens + (now - known.at) / REFILL_S)
        known.at = now
        return known
