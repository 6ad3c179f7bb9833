"""Messages that the daemon itself sends, each at its time."""

from collections.abc import Iterator
from typing import Generic, Protocol, TypeVar


class Timed(Protocol):
    """A message that is due `at` seconds after the beginning."""

    @property
    def at(self) -> float:
        """When the message is due, in s after the beginning."""


_Message = TypeVar("_Message", bound=Timed)


class OwnTraffic(Generic[_Message]):
    """A plan in the order of time; nothing of it is due before it has begun."""

    def __init__(self, plan: Iterator[_Message]) -> None:
        self._plan = plan
        self._began_at = float("inf")
        self._upcoming = next(plan, None)

    def begin(self, now: float) -> None:
        """Begin the plan at `now`, in s; beginning twice is fine."""
        self._began_at = min(self._began_at, now)

    @property
    def is_over(self) -> bool:
        """Whether nothing of the plan is still to come."""
        return self._upcoming is None

    def due(self, now: float) -> Iterator[tuple[float, _Message]]:
        """(when it was due, message) for each that is due until `now`."""
        while (message := self._upcoming) is not None and self._began_at + message.at <= now:
            yield self._began_at + message.at, message
            self._upcoming = next(self._plan, None)
