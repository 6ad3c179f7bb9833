"""Generated traffic: messages that the daemon itself sends, each at its time."""

from collections.abc import Iterator
from typing import Generic, Protocol, TypeVar


class Timed(Protocol):
    """A message that is due `at` seconds after the start."""

    @property
    def at(self) -> float:
        """Time in s after the start at which the message is due."""


_Message = TypeVar("_Message", bound=Timed)


class OwnTraffic(Generic[_Message]):
    """A plan of messages in order of time; none is due before `begin` is called."""

    def __init__(self, plan: Iterator[_Message]) -> None:
        self._plan = plan
        self._began_at = float("inf")
        self._upcoming = next(plan, None)

    def begin(self, now: float) -> None:
        """Start the plan at `now`, in s; later calls have no effect."""
        self._began_at = min(self._began_at, now)

    @property
    def is_over(self) -> bool:
        """Whether all messages of the plan have been taken."""
        return self._upcoming is None

    def due(self, now: float) -> Iterator[tuple[float, _Message]]:
        """(due time in s, message) for each message due up to `now`."""
        while (message := self._upcoming) is not None and self._began_at + message.at <= now:
            yield self._began_at + message.at, message
            self._upcoming = next(self._plan, None)
