"""Remembers the messages of the last seconds by their names."""

from collections import deque
from collections.abc import Hashable
from typing import Generic, TypeVar

from sdrlinkd.client import MessageName

WINDOW_S = 2.0
"""Time in s for which names of messages are compared."""

T = TypeVar("T")
Key = tuple[Hashable, ...]
"""Whatever tells topics apart: robot, topic and series."""


class NamedRecently(Generic[T]):
    """A value for each message of the last WINDOW_S; times in s, never going back."""

    def __init__(self) -> None:
        self._named: dict[Key, list[tuple[MessageName, T]]] = {}
        self._order: deque[tuple[float, Key]] = deque()

    def find(self, key: Key, name: MessageName, now: float) -> T | None:
        """The value of the message; None if it is not known."""
        self._forget(now)
        for known, value in self._named.get((*key, name.entry_id), ()):
            if known.matches(name):
                return value
        return None

    def add(self, key: Key, name: MessageName, value: T, now: float) -> None:
        """Remember a message that `find` did not know."""
        entry = (*key, name.entry_id)
        self._named.setdefault(entry, []).append((name, value))
        self._order.append((now, entry))

    def _forget(self, now: float) -> None:
        while self._order and self._order[0][0] < now - WINDOW_S:
            _, entry = self._order.popleft()
            named = self._named[entry]
            del named[0]
            if not named:
                del self._named[entry]


class Duplicates:
    """Tells a consumer of a fleet which messages it has had."""

    def __init__(self) -> None:
        self._known: NamedRecently[bool] = NamedRecently()
        self.dropped = 0
        """Messages that came again."""

    def is_new(self, key: Key, name: MessageName | None, now: float) -> bool:
        """Whether a message comes for the first time; one without a name always does."""
        if name is None:
            return True
        if self._known.find(key, name, now):
            self.dropped += 1
            return False
        self._known.add(key, name, True, now)
        return True
