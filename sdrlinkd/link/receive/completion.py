"""What becomes of a whole message: handed over, dropped, or held until its topic is declared."""

from math import inf

from sdrlinkd.link.receive.acceptance import Acceptance
from sdrlinkd.link.receive.delivered import DELIVERED, Delivered
from sdrlinkd.link.receive.events import Ended, Event
from sdrlinkd.link.receive.neighbors import Neighbors
from sdrlinkd.link.receive.rx_ledger import RxLedger
from sdrlinkd.link.receive.undeclared import UndeclaredMessages, Whole
from sdrlinkd.link.topics import HeardTopic, HeardTopics
from sdrlinkd.wire import FIRST_NUMBER

SAME_TIME_S = 1e-3
"""Difference in s of two ages that says nothing about the order of messages."""


class Completion:
    """Ends the life of each received message under one name; outcomes are added to `events`."""

    def __init__(
        self, topics: HeardTopics, acceptance: Acceptance, ledger: RxLedger, neighbors: Neighbors
    ) -> None:
        self._topics = topics
        self._acceptance = acceptance
        self._ledger = ledger
        self._neighbors = neighbors
        self._newest_at: dict[tuple[int, int], float] = {}
        """When the newest message was submitted, by (source, number of the topic)."""
        self.undeclared = UndeclaredMessages()
        """Messages of topics that were not declared yet."""

    def take(self, message: Whole, now: float, events: list[Event]) -> None:
        """Take a message that has just become whole."""
        is_known = self._topics.topic(message.src, message.number) is not None
        if is_known or message.number < FIRST_NUMBER:
            self._judge(message, now, events)
            return
        for given_up in self.undeclared.hold(message, now):
            self._end(given_up, "rx_unknown_topic", now, events)

    def declared(self, src: int, number: int, now: float, events: list[Event]) -> None:
        """Hand over the messages that waited for the declaration of a topic."""
        for message in self.undeclared.release(src, number):
            self._judge(message, now, events)

    def forget(self, src: int, now: float, events: list[Event]) -> None:
        """Drop what waits for declarations of a robot that has restarted."""
        self._newest_at = {key: at for key, at in self._newest_at.items() if key[0] != src}
        for message in self.undeclared.of_source(src):
            self._end(message, "rx_unknown_topic", now, events)

    def begin_anew(self) -> None:
        """Go on with another clock; what came before says nothing about the order."""
        self._newest_at.clear()

    def expire(self, now: float, events: list[Event]) -> None:
        """Drop the messages whose topics were not declared in time."""
        for message in self.undeclared.expire(now):
            self._end(message, "rx_unknown_topic", now, events)

    def drop(self, src: int, topic_id: int, reason: str) -> None:
        """Count a message that did not become whole under a reason of the ledger."""
        topic = self._topics.topic(src, topic_id)
        self._ledger.tally(src, topic_id if topic is None else topic.base).drop(reason)

    def _judge(self, message: Whole, now: float, events: list[Event]) -> None:
        src, number = message.src, message.number
        topic = self._topics.topic(src, number)
        if topic is None or self._topics.differs(topic):
            reason = "rx_unknown_topic" if topic is None else "rx_other_type"
            self._end(message, reason, now, events)
            return
        if not self._acceptance.takes_from(topic, src):
            self._end(message, "rx_denied", now, events)
            return
        if not message.is_proven and not self._acceptance.takes_unproven(topic):
            self._end(message, "rx_unproven", now, events)
            return
        took_s = message.heard_at - message.began_at
        payload, refused = self._acceptance.judge(
            topic, message.payload, message.is_compressed, message.origin.at, took_s, now,
            to_one=message.to_one,
        )  # fmt: skip
        if refused is not None:
            self._end(message, refused, now, events)
            return
        if self._is_outdated(message, topic):
            self._end(message, "rx_outdated", now, events)
            return
        _answer(message, DELIVERED, now, events)
        tally = self._ledger.tally(src, topic.base)
        tally.deliver(len(payload))
        neighbor = self._neighbors.get(src)
        lost_pdus = 0 if neighbor is None else neighbor.track.lost
        events.append(
            Delivered(
                src, topic.base, payload, tally.delivered, lost_pdus, message.origin.at,
                message.heard_at, message.hops_left, message.snr_db, message.began_at,
                message.ended_at, number, topic, message.name, message.to_one, message.is_sealed,
            )
        )  # fmt: skip

    def _is_outdated(self, message: Whole, topic: HeardTopic) -> bool:
        """Whether a message comes after a newer one, where that matters."""
        origin_at, key = message.origin.at, (message.src, message.number)
        if origin_at is None or not self._acceptance.drops_late(topic, to_one=message.to_one):
            return False
        newest_at = self._newest_at.get(key, -inf)
        self._newest_at[key] = max(newest_at, origin_at)
        return origin_at < newest_at - SAME_TIME_S

    def _end(self, message: Whole, reason: str, now: float, events: list[Event]) -> None:
        self.drop(message.src, message.number, reason)
        _answer(message, reason, now, events)


def _answer(message: Whole, ended: str, now: float, events: list[Event]) -> None:
    """Add the event for a message whose sender wants a receipt."""
    origin = message.origin
    if origin.asks:
        age_s = None if origin.at is None else now - origin.at
        events.append(Ended(message.src, *message.stamped, ended, age_s, now))
