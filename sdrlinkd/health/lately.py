"""Growth of counters within the last seconds, from snapshots."""

from collections import deque
from typing import NamedTuple

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


class _Counts(NamedTuple):
    """Counters at a time: messages shed by topic, those of the PDU link, PDUs dropped by reason."""

    at: float
    shed: dict[str, int]
    pdu_link: dict[str, int]
    pdus_dropped: dict[str, int]


class Lately:
    """Counters of the snapshots of the last `RATE_WINDOW_S`, taken about once a second."""

    def __init__(self) -> None:
        self._seen: deque[_Counts] = deque()

    def note(self, snapshot: Snapshot) -> None:
        """Add a snapshot, and drop those before the window."""
        now = snapshot.uptime_s
        while self._seen and now - self._seen[0].at > RATE_WINDOW_S:
            self._seen.popleft()
        counters, dropped = snapshot.carrier.counters, snapshot.link.rx.pdus_dropped
        self._seen.append(_Counts(now, shed_by_topic(snapshot), counters, dropped))

    def shed(self, snapshot: Snapshot) -> dict[str, int]:
        """Messages dropped within the window for lack of airtime, by topic, the most first."""
        if not self._seen:
            return {}
        before = self._seen[0].shed
        grown = {name: n - before.get(name, 0) for name, n in shed_by_topic(snapshot).items()}
        kept = {name: n for name, n in grown.items() if n > 0}
        return dict(sorted(kept.items(), key=lambda each: -each[1]))

    def grown(self, snapshot: Snapshot, counter: str) -> int:
        """Growth of a counter of the PDU link within the window."""
        before = self._seen[0].pdu_link if self._seen else snapshot.carrier.counters
        return snapshot.carrier.counters.get(counter, 0) - before.get(counter, 0)

    def refused(self, snapshot: Snapshot, reason: str) -> int:
        """Growth of the number of PDUs dropped for a reason within the window."""
        now = snapshot.link.rx.pdus_dropped
        before = self._seen[0].pdus_dropped if self._seen else now
        return now.get(reason, 0) - before.get(reason, 0)
