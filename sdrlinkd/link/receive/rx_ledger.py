"""The receive ledger: every PDU and every message ends under exactly one name."""

from collections import Counter
from collections.abc import Hashable
from typing import NamedTuple

from sdrlinkd.link.queue import RxTally, balance
from sdrlinkd.link.topics import HeardTopics
from sdrlinkd.reports import ReceivedTopicReport, RxReport
from sdrlinkd.wire import PARTS

MOST_TALLIES = 1024
"""Most topics that are counted one by one, and twice as many if they are known; those of a robot
that come later share a tally."""
OTHERS = -1
"""In place of their topic ids."""
_UNKNOWN = {PARTS: "(parts)", OTHERS: "(further topics)"}


class Held(NamedTuple):
    """Messages begun since the start, and those that are still incomplete."""

    started: int
    held: int
    held_bytes: int


class RxLedger:
    """Counts PDUs heard, and messages by (source, topic id)."""

    def __init__(self, topics: HeardTopics) -> None:
        self._topics = topics
        self._tallies: dict[tuple[int, int], RxTally] = {}
        self._pdus_heard = 0
        self._pdus_used = 0
        self._pdus_dropped: Counter[str] = Counter()
        self._control_bad = 0
        self.fragments_repaired = 0
        """Number of lost fragments computed from parity."""

    def hear(self) -> None:
        """Count a received PDU."""
        self._pdus_heard += 1

    def use(self) -> None:
        """Count a PDU with entries for this robot."""
        self._pdus_used += 1

    def drop_pdu(self, reason: str) -> None:
        """Count a PDU under a reason of RX_PDU_REASONS."""
        self._pdus_dropped[reason] += 1

    def relay_refused(self) -> None:
        """Move one PDU from rx_relayed to rx_not_for_us, as the queue refused it."""
        self._pdus_dropped["rx_relayed"] -= 1
        self._pdus_dropped["rx_not_for_us"] += 1

    def relayed_after_all(self) -> None:
        """Move one PDU from rx_not_for_us to rx_relayed, as it is forwarded later."""
        self._pdus_dropped["rx_not_for_us"] -= 1
        self._pdus_dropped["rx_relayed"] += 1

    def skip_records(self, n: int) -> None:
        """Count control entries that could not be read (rx_control_bad)."""
        self._control_bad += n

    def repair(self, n: int) -> None:
        """Count fragments computed from parity."""
        self.fragments_repaired += n

    def tally(self, src: int, topic_id: int) -> RxTally:
        """The message counters of one topic from one source."""
        tally = self._tallies.get((src, topic_id))
        if tally is None and len(self._tallies) >= MOST_TALLIES:
            # Numbers that mean nothing must leave room for topics.
            n, is_known = len(self._tallies), self._topics.topic(src, topic_id) is not None
            topic_id = topic_id if is_known and n < 2 * MOST_TALLIES else OTHERS
            tally = self._tallies.get((src, topic_id))
        if tally is None:
            tally = self._tallies[src, topic_id] = RxTally()
        return tally

    def report(self, held: Held) -> RxReport:
        """The report with the sums over all topics."""
        return RxReport(
            pdus_heard=self._pdus_heard,
            pdus_used=self._pdus_used,
            pdus_dropped=dict(+self._pdus_dropped),
            started=held.started,
            delivered=self._delivered,
            held=held.held,
            held_bytes=held.held_bytes,
            dropped=dict(self._dropped),
            control_bad=self._control_bad,
        )

    def report_topics(self) -> list[ReceivedTopicReport]:
        """Reports on each topic of each source, without rates, ages and bus names."""
        reports = []
        for (src, topic_id), tally in sorted(self._tallies.items()):
            topic = None if topic_id == OTHERS else self._topics.topic(src, topic_id)
            unknown = _UNKNOWN.get(topic_id, f"(topic id {topic_id})")
            ended = tally.delivered + sum(tally.dropped.values())
            reports.append(
                ReceivedTopicReport(
                    src=src,
                    topic_id=topic_id,
                    name="/" + topic.name if topic else unknown,
                    republished_as="",
                    delivered=tally.delivered,
                    delivered_bytes=tally.delivered_bytes,
                    dropped=dict(tally.dropped),
                    pdr=tally.delivered / ended if ended else None,
                )
            )
        return reports

    def counters(self) -> dict[Hashable, int]:
        """The counters for which rates are reported."""
        found: dict[Hashable, int] = {}
        for key, tally in self._tallies.items():
            found["rx", *key] = tally.delivered
            found["delivered_bytes", *key] = tally.delivered_bytes
        return found

    def audit(self, held: Held) -> list[str]:
        """Discrepancies in the receive ledgers, as sentences; empty when they add up."""
        return balance(
            "rx pdus", self._pdus_heard, {"used": self._pdus_used, **self._pdus_dropped}
        ) + balance(
            "rx messages",
            held.started,
            {"delivered": self._delivered, "held": held.held, **self._dropped},
        )

    @property
    def _delivered(self) -> int:
        return sum(tally.delivered for tally in self._tallies.values())

    @property
    def _dropped(self) -> Counter[str]:
        return sum((tally.dropped for tally in self._tallies.values()), Counter())
