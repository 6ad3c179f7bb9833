"""Growth of counters within the last seconds, from snapshots."""

from collections import deque

from sdrlinkd.reports import RATE_WINDOW_S, Snapshot

SHED = (
    "tx_overflow_old",
    "tx_overflow_new",
    "tx_topic_full",
    "tx_expired",
    "tx_too_slow",
    "tx_stalled",
)
"""Reasons of drops that more airtime would have prevented."""


def shed_by_topic(snapshot: Snapshot) -> dict[str, int]:
    """Messages dropped so far for lack of airtime, by topic."""
    return {
        topic.name: sum(topic.dropped.get(reason, 0) for reason in SHED)
        for topic in snapshot.link.topics
    }


class Lately:
    """Counters of the snapshots of the last `RATE_WINDOW_S`, taken about once a second."""

    def __init__(self) -> None:
        self._seen: deque[tuple[float, dict[str, int], dict[str, int]]] = deque()

    def note(self, snapshot: Snapshot) -> None:
        """Add a snapshot, and drop those before the window."""
        now = snapshot.uptime_s
        while self._seen and now - self._seen[0][0] > RATE_WINDOW_S:
            self._seen.popleft()
        self._seen.append((now, shed_by_topic(snapshot), snapshot.carrier.counters))

    def shed(self, snapshot: Snapshot) -> dict[str, int]:
        """Messages dropped within the window for lack of airtime, by topic, the most first."""
        if not self._seen:
            return {}
        _, before, _ = self._seen[0]
        grown = {name: n - before.get(name, 0) for name, n in shed_by_topic(snapshot).items()}
        kept = {name: n for name, n in grown.items() if n > 0}
        return dict(sorted(kept.items(), key=lambda each: -each[1]))

    def grown(self, snapshot: Snapshot, counter: str) -> int:
        """Growth of a counter of the PDU link within the window."""
        if not self._seen:
            return 0
        return snapshot.carrier.counters.get(counter, 0) - self._seen[0][2].get(counter, 0)
