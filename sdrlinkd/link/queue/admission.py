"""Decides which messages a topic's policy lets into the queue."""

from collections import OrderedDict
from math import inf

from sdrlinkd.link.queue.policy import TopicPolicy
from sdrlinkd.link.topics import MOST_KEYS

NOT_TAKEN = frozenset({
    "tx_size_cap", "tx_unchanged", "tx_decimated", "tx_throttled", "tx_too_big", "tx_not_admitted",
})  # fmt: skip
"""Reasons under which a message is refused before it enters the queue."""


class _Grid:
    """Lets a message pass in each period; a grid keeps the period on average."""

    __slots__ = ("_at",)

    def __init__(self) -> None:
        self._at = -inf

    def passes(self, period_s: float, now: float) -> bool:
        """Whether a message at `now` is due, which is noted. The period may have changed."""
        late_s = now - (self._at + period_s)
        if late_s < 0:
            return False
        self._at = now - (late_s if late_s < period_s else 0.0)
        return True


class Admission:
    """Admission control of one topic: size cap, throttle, decimation and change detection."""

    __slots__ = ("_enough", "_grid", "_last", "_number", "_policy", "enough_s")

    def __init__(self, policy: TopicPolicy) -> None:
        self._policy = policy
        self._grid = _Grid()
        self._enough: OrderedDict[str, _Grid] = OrderedDict()
        """By producer key, so that no producer takes the turns of another."""
        self._number = 0
        self._last: bytes | None = None
        self.enough_s = 0.0
        """Period in s that suffices all consumers; 0: they want every message."""

    def refuse(self, payload: bytes, now: float, key: str = "", *, is_for_all: bool) -> str | None:
        """The ledger's reason for refusing a message; None: it is admitted and remembered.

        `is_for_all`: it is neither a command nor for one robot, nor does anybody await its receipt,
        so what consumers ask for holds. `key` is that of its producer.
        """
        policy = self._policy
        if policy.max_bytes and len(payload) > policy.max_bytes:
            return "tx_size_cap"
        if policy.on_change and payload == self._last:
            return "tx_unchanged"
        if policy.decimate > 1:
            self._number += 1
            if self._number % policy.decimate != 1:
                return "tx_decimated"
        if policy.period_s and not self._grid.passes(policy.period_s, now):
            return "tx_throttled"
        is_slowed = self.enough_s > 0 and is_for_all and not policy.latched
        if is_slowed and not self._of(key).passes(self.enough_s, now):
            return "tx_throttled"
        if policy.on_change:
            self._last = payload
        return None

    def _of(self, key: str) -> _Grid:
        grid = self._enough.setdefault(key, _Grid())
        self._enough.move_to_end(key)
        if len(self._enough) > MOST_KEYS:
            self._enough.popitem(last=False)
        return grid
