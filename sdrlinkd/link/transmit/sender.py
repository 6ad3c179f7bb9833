"""The transmit half of the link: from submitted messages to confirmed bursts."""

from collections.abc import Mapping, Sequence
from math import inf
from random import Random

from zstandard import ZstdCompressionDict

from sdrlinkd.link.packing import BuiltPdu, Packetizer
from sdrlinkd.link.params import LinkParams, QueueParams
from sdrlinkd.link.qos import AS_CONFIGURED, CLASSES, Overrides, Qos
from sdrlinkd.link.queue import (
    DEFAULT_POLICY,
    Lifespan,
    Offer,
    Outbox,
    Outgoing,
    TopicPolicy,
    TopicState,
    TxTally,
    lifespan_of,
    tx_balance,
)
from sdrlinkd.link.schedule import Allowance, ClassesParams
from sdrlinkd.link.transmit.burst import Burst, Outcome
from sdrlinkd.wire import Pdu, Registry, max_message_size

RELAYED = 256
"""Lanes of others' PDUs have this and their source in place of a topic id."""
UNLIKELY_AGE_S = 10.0
"""A message without a lifespan that was published so long ago comes from another clock or a
recording: its age counts from now."""
MAX_PDUS = 63
"""Of a burst, whatever carries it."""


class Sender:
    """Queue, packetizer and the TX ledger of one node."""

    def __init__(
        self,
        params: LinkParams,
        queue: QueueParams,
        registry: Registry,
        src: int,
        rng: Random,
        reassembly_timeout_s: float,
        classes: ClassesParams,
        dictionaries: Mapping[int, ZstdCompressionDict],
    ) -> None:
        self._max_message_size = max_message_size(params.pdu_size)
        self._classes = classes
        self.outbox = Outbox(queue)
        self.lives = self.outbox.lives
        self.packetizer = Packetizer(
            params, src, self.outbox, rng, reassembly_timeout_s, registry.has_control, classes
        )
        self._topics = [
            TopicState(params.dst, registry.has_control, dictionaries.get(topic.id))
            for topic in registry.topics
        ]
        self.n_topics = len(self._topics)
        self.refused = TxTally()
        """Messages that never became a topic's: bad envelopes, unknown topics."""
        self.relayed = TxTally()
        """PDUs of others; each counts as a message."""
        self.entries_composed = 0
        self.pdus_composed = 0
        self.pdus_sent = 0
        self.pdus_failed = 0
        self._has_control = registry.has_control
        self.bursts_sent = 0
        self.bursts_failed = 0

    def submit(
        self,
        topic_id: int,
        payload: bytes,
        now: float,
        overrides: Overrides = AS_CONFIGURED,
    ) -> str | None:
        """Queue a message; None, or the ledger's reason why it was refused."""
        topic = self._topics[topic_id]
        topic.tally.accept(len(payload))
        refused = topic.admission.refuse(payload, now)
        if refused:
            topic.tally.drop(refused)
            return refused
        return self._enqueue(topic_id, payload, now, now, overrides)

    def offer_again(self, offer: Offer, now: float) -> None:
        """Queue a latched message for a robot that came late, as old as it is."""
        topic_id, (payload, at, overrides), dst = offer
        topic = self._topics[topic_id]
        lifespan_s = overrides.lifespan_s or self.lifespan(topic_id, overrides.qos).seconds
        if at + lifespan_s <= now:
            return
        topic.tally.accepted += 1
        topic.tally.reoffered += 1
        self._enqueue(topic_id, payload, at, now, overrides._replace(dst=dst))

    def forward(self, pdu: Pdu, data: bytes, at: float, until: float) -> str | None:
        """Queue another robot's PDU that came in a burst at `at`; None, or why it was refused."""
        tally = self.relayed
        tally.accepted += 1
        known = [each.topic_id for each in pdu.entries if each.topic_id < len(self._topics)]
        priority = max((self._topics[each].priority for each in known), default=0)
        message = Outgoing(
            RELAYED + pdu.src, data, CLASSES[pdu.qos], priority, pdu.dst, at, until, False, tally,
            is_whole=True,
        )  # fmt: skip
        return self.outbox.put(message, DEFAULT_POLICY)

    def _enqueue(
        self, topic_id: int, payload: bytes, at: float, now: float, wishes: Overrides
    ) -> str | None:
        qos, priority, dst, lifespan_s, age_s, receipt = wishes
        topic = self._topics[topic_id]
        if lifespan_s is None:
            lifespan_s = self.lifespan(topic_id, qos).seconds
        if age_s <= UNLIKELY_AGE_S or lifespan_s < inf:
            at -= age_s
        frame = topic.deflated.shrink(payload) if topic.deflated else None
        if frame is not None:
            payload = frame
        if len(payload) > self._max_message_size:
            topic.tally.drop("tx_too_big")
            return "tx_too_big"
        message = Outgoing(
            topic_id,
            payload,
            topic.qos if qos is None else qos,
            topic.priority if priority is None else priority,
            topic.dst if dst is None else dst,
            at,
            at + lifespan_s,
            topic.stamp or (bool(receipt) and self._has_control),
            topic.tally,
            # Without a control channel it has been answered already: nobody can know.
            receipt=receipt if self._has_control else "",
            is_compressed=frame is not None,
        )
        if message.expires_at <= now:
            # It must not take the place of one that is fresh.
            self.lives.drop(message, "tx_expired")
            return "tx_expired"
        return self.outbox.put(message, topic.policy)

    def refuse(self, reason: str, topic_id: int | None = None) -> None:
        """Count a message that the bus could not hand over."""
        tally = self.refused if topic_id is None else self._topics[topic_id].tally
        tally.accepted += 1
        tally.drop(reason)

    def compose(self, start: float, allowance: Allowance, src: int | None = None) -> Burst | None:
        """The next burst, whose preamble leaves at `start`; None when nothing is to be sent.

        All its PDUs are of one source, `src` if given: who hears it knows by that who may follow.
        """
        burst, levels, next_src = Burst([], [], []), self.outbox.levels, self.packetizer.next_src
        # What is owed takes room from others; it makes no burst longer.
        owed = list(allowance.owed[: max(1, max(allowance.most) - 1)])
        n = 0
        while levels and n < MAX_PDUS:
            first, most = None, allowance.most[levels[0].key[0]]
            if owed and n + len(owed) >= most and (n or most < 2):
                first = owed.pop(0)
            elif owed and not n and next_src(owed[0]) != next_src():
                # It cannot join, so it goes alone.
                first, owed, most = owed[0], [], 0
            elif n >= most:
                break
            several: Sequence[BuiltPdu] = ()
            if first is None:
                room = min(most, MAX_PDUS) - n
                several = self.packetizer.next_full(start, max(1, room - len(owed)), src)
            if not several:
                built = self.packetizer.next_pdu(start, first, src)
                if built is None:
                    break
                several = (built,)
            for data, carried, qos in several:
                burst.pdus.append(data)
                burst.carried.append(carried)
                burst.classes.append(qos)
            src = burst.pdus[0][1]
            n += len(several)
        return self._counted(burst)

    def expire(self, now: float) -> None:
        """Drop heads whose lifespan ended while no burst could go."""
        self.packetizer.head_of_line.expire(now)

    def compose_records(self, start: float) -> Burst | None:
        """A burst of one PDU for control records that found no spare room."""
        built = self.packetizer.records_pdu(start)
        if built is None:
            return None
        return self._counted(Burst([built.data], [[]], [built.qos], n_records=1))

    def confirm(self, burst: Burst, outcome: Outcome, now: float) -> None:
        """The radio's word on a burst: its messages are sent, or dropped by name."""
        if outcome is Outcome.SENT:
            self.bursts_sent += 1
            self.pdus_sent += len(burst.pdus)
            self.lives.left(burst.carried)
        else:
            self.bursts_failed += 1
            self.pdus_failed += len(burst.pdus)
            for message in self.lives.failed(burst.carried):
                self.packetizer.head_of_line.abandon(message.lane, now)

    def begin_anew(self) -> None:
        """Time begins: what came before is dropped, and nothing is remembered of when."""
        self.shut_down("tx_radio_down")
        for topic in self._topics:
            topic.apply(topic.policy)

    def shut_down(self, reason: str = "tx_shutdown") -> None:
        """Drop what is still waiting or unconfirmed."""
        self.outbox.drop_all(reason)

    def tally(self, topic_id: int) -> TxTally:
        """Counters of one topic."""
        return self._topics[topic_id].tally

    def policy(self, topic_id: int) -> TopicPolicy:
        """That in force."""
        return self._topics[topic_id].policy

    def set_policy(self, topic_id: int, policy: TopicPolicy) -> None:
        """From now on."""
        topic = self._topics[topic_id]
        if policy != topic.policy:
            topic.apply(policy)

    def destination(self, topic_id: int) -> int:
        """Where a topic's messages go by default."""
        return self._topics[topic_id].dst

    def treatment(self, topic_id: int) -> tuple[Qos, int]:
        """Class and priority that a topic's messages get by default."""
        topic = self._topics[topic_id]
        return topic.qos, topic.priority

    def lifespan(self, topic_id: int, qos: Qos | None = None) -> Lifespan:
        """That of a topic's messages that name none; of class `qos`, else of the topic's."""
        topic = self._topics[topic_id]
        return lifespan_of(topic.policy, topic.qos if qos is None else qos, self._classes)

    def audit(self) -> list[str]:
        """What does not add up in the TX ledger; empty when all does."""
        tallies = [self.refused, self.relayed, *(topic.tally for topic in self._topics)]
        problems = tx_balance(tallies, self.outbox.queued, len(self.lives.in_flight))
        if self.lives.illegal_steps:
            problems.append(f"tx messages: {self.lives.illegal_steps} illegal steps")
        return problems

    def _counted(self, burst: Burst) -> Burst | None:
        self.pdus_composed += len(burst.pdus)
        self.entries_composed += sum(map(len, burst.carried))
        return burst if burst.pdus else None
