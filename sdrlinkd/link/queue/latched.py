"""`transient_local`: latches the last messages of a topic and replays them to late joiners."""

from collections import OrderedDict, deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

from sdrlinkd.link.qos import Overrides
from sdrlinkd.link.topics import MOST_KEYS
from sdrlinkd.wire import BROADCAST

SHARE = 0.02
"""Largest share of airtime for replayed messages."""
MOST_CREDIT_S = 1.0
MOST_BYTES = 64 << 20
"""Most payload bytes latched, as far as a topic's keys and older messages can be dropped."""
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


@dataclass(slots=True, eq=False)
class _Latched:
    topic_id: int
    kept: Kept
    number: int
    owed: set[int] = field(default_factory=set)


class Latched:
    """Keeps latched messages by topic and producer key, and decides when one is replayed.

    Messages are replayed in the order of their submission. Of more than MOST_KEYS keys of a topic,
    the one that was silent for longest is dropped.
    """

    def __init__(self, most_bytes: int = MOST_BYTES) -> None:
        self._most_bytes = most_bytes
        self._topics: dict[int, OrderedDict[str, deque[_Latched]]] = {}
        self._count = self._n_bytes = 0
        self._credit_s = 0.0
        self._looked_at: float | None = None
        self._came_at = float("-inf")
        self._is_owing = False

    def keep(self, topic_id: int, kept: Kept, depth: int) -> None:
        """Latch a key's newest message, which robots already present receive anyway.

        Of each key, the last `depth` messages are latched.
        """
        keys = self._topics.setdefault(topic_id, OrderedDict())
        messages = keys.setdefault(kept.overrides.key, deque())
        keys.move_to_end(kept.overrides.key)
        self._count += 1
        # A robot that is owed older messages of the key gets this one after them.
        owed = set[int]().union(*(each.owed for each in messages))
        messages.append(_Latched(topic_id, kept, self._count, owed))
        self._n_bytes += len(kept.payload)
        while len(messages) > depth:
            self._n_bytes -= len(messages.popleft().kept.payload)
        while len(keys) > 1 and (len(keys) > MOST_KEYS or self._n_bytes > self._most_bytes):
            _, silent = keys.popitem(last=False)
            self._n_bytes -= sum(len(each.kept.payload) for each in silent)
        while len(messages) > 1 and self._n_bytes > self._most_bytes:
            self._n_bytes -= len(messages.popleft().kept.payload)

    def forget(self, topic_id: int) -> None:
        """Drop the latched messages of a topic that is now volatile."""
        for messages in self._topics.pop(topic_id, OrderedDict()).values():
            self._n_bytes -= sum(len(each.kept.payload) for each in messages)

    def newcomer(self, node: int, now: float) -> None:
        """Note a robot that was heard for the first time or has restarted."""
        self._came_at = now
        for each in self._messages():
            each.owed.add(node)
            self._is_owing = True

    def due(self, now: float, bytes_per_s: float) -> Iterator[Offer]:
        """Messages to replay at `now`, on a channel that carries `bytes_per_s`."""
        passed_s = 0.0 if self._looked_at is None else max(0.0, now - self._looked_at)
        self._credit_s = min(MOST_CREDIT_S, self._credit_s + SHARE * passed_s)
        self._looked_at = now
        if not self._is_owing or now - self._came_at < WAIT_S:
            return
        owing = [each for each in self._messages() if each.owed]
        for each in sorted(owing, key=lambda latched: latched.number):
            if self._credit_s < 0:
                return
            self._credit_s -= len(each.kept.payload) / bytes_per_s
            wanted = each.kept.overrides.dst
            mine = each.owed if wanted in (None, BROADCAST) else each.owed & {wanted}
            each.owed = set()
            if mine:
                dst = next(iter(mine)) if len(mine) == 1 else BROADCAST
                yield Offer(each.topic_id, each.kept, dst if wanted is None else wanted)
        self._is_owing = False

    def _messages(self) -> Iterator[_Latched]:
        for keys in self._topics.values():
            for messages in keys.values():
                yield from messages
