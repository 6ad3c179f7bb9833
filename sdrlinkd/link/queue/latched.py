"""`transient_local`: the last message of a topic, for robots that come late."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

from sdrlinkd.link.qos import Overrides
from sdrlinkd.wire import BROADCAST

SHARE = 0.02
"""Of the air, at most, for what is offered again."""
MOST_CREDIT_S = 1.0
WAIT_S = 0.2
"""A robot that has just come is rarely the only one."""


class Kept(NamedTuple):
    """A message as it was submitted at `at`."""

    payload: bytes
    at: float
    overrides: Overrides


class Offer(NamedTuple):
    """What is to be sent again, and to whom."""

    topic_id: int
    kept: Kept
    dst: int


@dataclass(slots=True)
class _Topic:
    kept: Kept
    owed: set[int] = field(default_factory=set)


class Latched:
    """Keeps them and says when one is to be sent again."""

    def __init__(self) -> None:
        self._topics: dict[int, _Topic] = {}
        self._credit_s = 0.0
        self._looked_at: float | None = None
        self._came_at = float("-inf")

    def keep(self, topic_id: int, kept: Kept) -> None:
        """The newest one, which everybody who is there is sent anyway."""
        self._topics[topic_id] = _Topic(kept)

    def forget(self, topic_id: int) -> None:
        """Keep no message of a topic that is volatile now."""
        self._topics.pop(topic_id, None)

    def newcomer(self, node: int, now: float) -> None:
        """A robot was heard for the first time, or has started anew."""
        self._came_at = now
        for topic in self._topics.values():
            topic.owed.add(node)

    def due(self, now: float, bytes_per_s: float) -> Iterator[Offer]:
        """What may be sent again at `now`, on an air that carries so much."""
        passed_s = 0.0 if self._looked_at is None else max(0.0, now - self._looked_at)
        self._credit_s = min(MOST_CREDIT_S, self._credit_s + SHARE * passed_s)
        self._looked_at = now
        if now - self._came_at < WAIT_S:
            return
        for topic_id, topic in self._topics.items():
            if not topic.owed or self._credit_s < 0:
                continue
            self._credit_s -= len(topic.kept.payload) / bytes_per_s
            wanted = topic.kept.overrides.dst
            mine = topic.owed if wanted in (None, BROADCAST) else topic.owed & {wanted}
            topic.owed = set()
            if mine:
                dst = next(iter(mine)) if len(mine) == 1 else BROADCAST
                yield Offer(topic_id, topic.kept, dst if wanted is None else wanted)
