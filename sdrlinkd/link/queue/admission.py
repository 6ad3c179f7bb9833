"""Decides which messages a topic's policy lets into the queue."""

from sdrlinkd.link.queue.policy import TopicPolicy

NOT_TAKEN = frozenset({
    "tx_size_cap", "tx_unchanged", "tx_decimated", "tx_throttled", "tx_too_big", "tx_not_admitted",
})  # fmt: skip
"""Reasons under which a message is refused before it enters the queue."""


class Admission:
    """Admission control of one topic: size cap, throttle, decimation and change detection."""

    __slots__ = ("_due_at", "_last", "_number", "_policy", "enough_s")

    def __init__(self, policy: TopicPolicy) -> None:
        self._policy = policy
        self._due_at = float("-inf")
        self._number = 0
        self._last: bytes | None = None
        self.enough_s = 0.0
        """Period in s that suffices all consumers; 0: they want every message."""

    def refuse(self, payload: bytes, now: float) -> str | None:
        """The ledger's reason for refusing a message; None: it is admitted and remembered."""
        policy = self._policy
        if policy.max_bytes and len(payload) > policy.max_bytes:
            return "tx_size_cap"
        if policy.on_change and payload == self._last:
            return "tx_unchanged"
        if policy.decimate > 1:
            self._number += 1
            if self._number % policy.decimate != 1:
                return "tx_decimated"
        if period_s := max(policy.period_s, 0.0 if policy.latched else self.enough_s):
            if now < self._due_at:
                return "tx_throttled"
            # A grid keeps the period on average even if it is no multiple of the producer's.
            late_s = now - self._due_at
            self._due_at = now + period_s - (late_s if late_s < period_s else 0.0)
        if policy.on_change:
            self._last = payload
        return None
