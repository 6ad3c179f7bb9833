"""`transient_local`: latches the last message of a topic and replays it to late joiners."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

from sdrlinkd.link.qos import Overrides
from sdrlinkd.wire import BROADCAST

SHARE = 0.02
"""Largest share of airtime for replayed messages."""
MOST_CREDIT_S = 1.0
WAIT_S = 0.2
"""Wait in s after a new robot, as others often follow soon."""


class Kept(NamedTuple):
    """A latched message, as submitted at `at`."""

    payload: bytes
    at: float
    overrides: Overrides


class Offer(NamedTuple):
    """A latched message to replay, and its destination."""

    topic_id: int
    kept: Kept
    dst: int


@dataclass(slots=True)
class _Topic:
    kept: Kept
    owed: set[int] = field(default_factory=set)


class Latched:
    """Keeps latched messages, and decides when one is replayed."""

    def __init__(self) -> None:
        self._topics: dict[int, _Topic] = {}
        self._credit_s = 0.0
        self._looked_at: float | None = None
        self._came_at = float("-inf")

    def keep(self, topic_id: int, kept: Kept) -> None:
        """Latch a topic's newest message, which robots already present receive anyway."""
        self._topics[topic_id] = _Topic(kept)

    def forget(self, topic_id: int) -> None:
        """Drop the latched message of a topic that is now volatile."""
        self._topics.pop(topic_id, None)

    def newcomer(self, node: int, now: float) -> None:
        """Note a robot that was heard for the first time or has restarted."""
        self._came_at = now
        for topic in self._topics.values():
            topic.owed.add(node)

    def due(self, now: float, bytes_per_s: float) -> Iterator[Offer]:
        """Messages to replay at `now`, on a channel that carries `bytes_per_s`."""
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
