"""Puts messages into the queue, by their topic's policy or as another robot's PDU."""

from collections import Counter
from collections.abc import Hashable, Mapping
from math import inf

from zstandard import ZstdCompressionDict

from sdrlinkd.link.params import LinkParams
from sdrlinkd.link.qos import AS_CONFIGURED, CLASSES, QOS_BY_LABEL, Overrides, Qos
from sdrlinkd.link.queue.child_frames import key_of
from sdrlinkd.link.queue.compression import most_expanded
from sdrlinkd.link.queue.latched import Offer
from sdrlinkd.link.queue.ledger import TxTally, tx_balance
from sdrlinkd.link.queue.lifespan import Lifespan, lifespan_of
from sdrlinkd.link.queue.message import Outgoing
from sdrlinkd.link.queue.outbox import Outbox
from sdrlinkd.link.queue.parting import Parting
from sdrlinkd.link.queue.policy import DEFAULT_POLICY, TopicPolicy
from sdrlinkd.link.queue.topic_state import TopicState
from sdrlinkd.link.schedule import ClassesParams
from sdrlinkd.link.topics import IDLE_S, OwnTopics
from sdrlinkd.reports import RelayReport, TopicReport
from sdrlinkd.wire import (
    BROADCAST,
    FIRST_NUMBER,
    PARTS,
    Pdu,
    Topic,
    max_large_size,
    max_size,
    octet,
    part_size,
)

RELAYED = 1 << 16
"""Lanes of relayed PDUs have this, plus 512 times their source, plus their topic, as topic id."""
UNLIKELY_AGE_S = 10.0
"""Age in s above which a message without a lifespan was probably stamped by another clock or comes
from a recording; its age then counts from its submission."""


class Intake:
    """Holds every topic's policy and counters, and puts messages into `outbox`.

    `bytes_per_s` is the present capacity of the channel; infinity while it is unknown. The large
    messages of each topic are numbered from `first_large` on, which differs after a restart.
    """

    def __init__(
        self,
        params: LinkParams,
        topics: OwnTopics,
        outbox: Outbox,
        classes: ClassesParams,
        dictionaries: Mapping[int, ZstdCompressionDict],
        first_large: int = 0,
        *,
        is_sealed: bool = False,
    ) -> None:
        self._is_sealed = is_sealed
        self._pdu_size = params.pdu_size
        self._dst = params.dst
        self._has_control = topics.registry.has_control
        self._has_numbers = topics.has_numbers
        self._classes = classes
        self._outbox = outbox
        self._own = topics
        self._first_large = first_large
        self._topics: dict[int, TopicState] = {}
        for topic in topics:
            self.add(topic.id, dictionaries.get(topic.id))
        self._slowed: set[int] = set()
        """Topics of which consumers ask for fewer messages."""
        self._refused = TxTally()
        """Messages without a topic of ours: bad envelopes, unknown topics."""
        self._relayed = TxTally()
        """Relayed PDUs of others; each counts as a message."""

    def add(self, topic_id: int, dictionary: ZstdCompressionDict | None = None) -> None:
        """Begin to take messages of a topic."""
        if topic_id not in self._topics:
            self._topics[topic_id] = TopicState(
                self._dst, self._has_control, dictionary, self._first_large
            )

    def used(self, topic_id: int, now: float) -> None:
        """Note that somebody uses a topic: a producer that has declared it."""
        self._topics[topic_id].used_at = now

    def unused(self, topic_id: int) -> None:
        """Note that a topic's producers have ended; the next message says otherwise."""
        self._topics[topic_id].used_at = -inf

    def suffice(self, periods_s: Mapping[str, float]) -> None:
        """Send no more of each topic than its consumers ask for: a message a period, by name."""
        if not periods_s and not self._slowed:
            return
        now = {
            topic.id: period for name, period in periods_s.items()
            if (topic := self._own.by_name(name)) is not None and topic.id in self._topics
        }  # fmt: skip
        for topic_id in self._slowed - now.keys():
            self._topics[topic_id].admission.enough_s = 0.0
        for topic_id, period_s in now.items():
            self._topics[topic_id].admission.enough_s = period_s
        self._slowed = set(now)

    def enough_s(self, topic_id: int) -> float:
        """Period in s of a topic's messages that suffices all consumers; 0: they want them all."""
        return self._topics[topic_id].admission.enough_s

    def is_idle(self, topic_id: int, now: float) -> bool:
        """Whether nobody has declared a topic or sent a message of it for IDLE_S."""
        return now - self._topics[topic_id].used_at >= IDLE_S

    def keyed(self, topic_id: int, payload: bytes, wishes: Overrides) -> Overrides:
        """`wishes` with a producer key for a latched message, if the topic's policy makes one."""
        policy = self._topics[topic_id].policy
        if wishes.key or not policy.latched:
            return wishes
        key = key_of(payload, policy)
        return wishes._replace(key=key) if key else wishes

    def submit(
        self,
        topic_id: int,
        payload: bytes,
        now: float,
        overrides: Overrides = AS_CONFIGURED,
        bytes_per_s: float = inf,
        *,
        is_admitted: bool = True,
    ) -> str | None:
        """Queue a message; returns None, or the ledger's reason for refusing it.

        `is_admitted`: the team has air for it.
        """
        topic = self._topics[topic_id]
        topic.used_at = now
        topic.tally.accept(len(payload))
        refused: str | None = "tx_not_admitted"
        if is_admitted:
            dst = topic.dst if overrides.dst is None else overrides.dst
            policy = topic.policy_to(dst)
            is_awaited = policy.is_command or dst != BROADCAST or bool(overrides.receipt)
            refused = topic.admission.refuse(payload, now, overrides.key, is_for_all=not is_awaited)
        if refused:
            topic.tally.drop(refused)
            return refused
        return self._enqueue(topic_id, payload, now, now, overrides, bytes_per_s)

    def offer_again(self, offer: Offer, now: float, bytes_per_s: float) -> None:
        """Queue a latched message for a late joiner; its age counts from its first submission."""
        topic_id, (payload, at, overrides), dst = offer
        topic = self._topics[topic_id]
        lifespan_s = overrides.lifespan_s or self.lifespan(topic_id, overrides.qos).seconds
        if at + lifespan_s <= now:
            return
        topic.tally.accept_again()
        self._enqueue(topic_id, payload, at, now, overrides._replace(dst=dst), bytes_per_s)

    def forward(
        self, pdu: Pdu, data: bytes, at: float, until: float, number: int | None,
        bytes_per_s: float, *, is_bare: bool = False,
    ) -> str | None:  # fmt: skip
        """Queue another robot's PDU, which arrived at `at` and is worthless after `until`.

        `number` is its PDU number, None if unknown. It gets the highest priority of its topics,
        and is charged to that topic of its source.
        `is_bare`: it holds only control records.
        Returns None, or the ledger's reason for refusing it.
        """
        tally = self._relayed
        tally.accept()
        ranks = [(self._priority(each.topic_id), each.topic_id) for each in pdu.entries]
        priority, topic = max(ranks, default=(0, 0))
        of_source = RELAYED + 512 * pdu.src + topic
        message = Outgoing(
            of_source, data, CLASSES[pdu.qos], priority, pdu.dst, at, until, False, tally,
            is_whole=True, pdu_number=number, is_bare=is_bare,
        )  # fmt: skip
        return self._outbox.put(message, DEFAULT_POLICY, bytes_per_s)

    def refuse(self, reason: str, topic_id: int | None = None) -> None:
        """Count a message that the bus refused."""
        tally = self._refused if topic_id is None else self._topics[topic_id].tally
        tally.accept()
        tally.drop(reason)

    def begin_anew(self) -> None:
        """Forget the arrival times of messages, as another clock starts."""
        for topic in self._topics.values():
            topic.apply(topic.policy, topic.command)
            topic.used_at = -inf

    def tally(self, topic_id: int) -> TxTally:
        """The message counters of one topic."""
        return self._topics[topic_id].tally

    def policy(self, topic_id: int) -> TopicPolicy:
        """The policy in force for a topic."""
        return self._topics[topic_id].policy

    def command(self, topic_id: int) -> TopicPolicy:
        """The policy in force for a topic's messages to one robot."""
        return self._topics[topic_id].command

    def set_policy(
        self,
        topic_id: int,
        policy: TopicPolicy,
        command: TopicPolicy | None = None,
        origin: str = "",
    ) -> None:
        """Change a topic's policy from now on.

        `command` is for messages that are sent to one robot; None: the same. `origin` says where
        it comes from, for reports.
        """
        topic = self._topics[topic_id]
        topic.origin = origin
        if (policy, command or policy) != (topic.policy, topic.command):
            topic.apply(policy, command)

    def destination(self, topic_id: int) -> int:
        """Default destination robot of a topic's messages."""
        return self._topics[topic_id].dst

    def treatment(self, topic_id: int, dst: int | None = None) -> tuple[Qos, int]:
        """Class and priority of a topic's messages to `dst` (None: its default destination)."""
        topic = self._topics[topic_id]
        policy = topic.policy_to(topic.dst if dst is None else dst)
        return QOS_BY_LABEL[policy.qos], policy.priority

    def lifespan(self, topic_id: int, qos: Qos | None = None) -> Lifespan:
        """Default lifespan of a topic's messages of class `qos` (None: the topic's class)."""
        topic = self._topics[topic_id]
        policy = topic.policy_to(topic.dst)
        return lifespan_of(policy, topic.qos if qos is None else qos, self._classes)

    def needed_bytes_per_s(self, topic_id: int) -> float:
        """What the channel must carry for the last command that was refused as too slow."""
        return self._topics[topic_id].needed_bytes_per_s

    def report_relayed(self) -> RelayReport:
        """The report on PDUs that this robot relays."""
        tally = self._relayed
        return RelayReport(accepted=tally.accepted, sent=tally.sent, dropped=dict(tally.dropped))

    def report(self, topic: Topic) -> TopicReport:
        """The report on one outgoing topic, without rates and bus names."""
        tally, (qos, priority) = self.tally(topic.id), self.treatment(topic.id)
        lifespan = self.lifespan(topic.id)
        return TopicReport(
            topic_id=topic.id,
            name="/" + topic.name,
            type=topic.type,
            subscribed=False,
            qos=qos.label,
            priority=priority,
            lifespan_s=lifespan.seconds if lifespan.source else None,
            lifespan_from=lifespan.source,
            policy_from=self._topics[topic.id].origin,
            accepted=tally.accepted,
            sent=tally.sent,
            sent_bytes=tally.sent_bytes,
            reoffered=tally.reoffered,
            queued=self._outbox.queued_of_topic(topic.id),
            dropped=dict(tally.dropped),
        )

    def totals(self) -> tuple[int, int, dict[str, int]]:
        """(messages accepted, sent, dropped by reason), including relayed PDUs."""
        tallies = self._tallies()
        return (
            sum(tally.accepted for tally in tallies),
            sum(tally.sent for tally in tallies),
            dict(sum((tally.dropped for tally in tallies), Counter())),
        )

    def counters(self) -> dict[Hashable, int]:
        """The counters for which rates are reported."""
        found: dict[Hashable, int] = {}
        for topic_id, topic in self._topics.items():
            found["tx", topic_id] = topic.tally.accepted
            found["accepted_bytes", topic_id] = topic.tally.accepted_bytes
        return found

    def audit(self) -> list[str]:
        """Discrepancies in the transmit ledger, as sentences; empty when it adds up."""
        outbox, lives = self._outbox, self._outbox.lives
        problems = tx_balance(self._tallies(), outbox.queued, outbox.in_flight)
        if lives.illegal_steps:
            problems.append(f"tx messages: {lives.illegal_steps} illegal steps")
        return problems

    def _tallies(self) -> list[TxTally]:
        return [self._refused, self._relayed, *(topic.tally for topic in self._topics.values())]

    def _priority(self, topic_id: int) -> int:
        """The priority of another robot's entry of a topic, as far as it is known here."""
        if FIRST_NUMBER <= topic_id <= PARTS:
            return DEFAULT_POLICY.priority
        topic = self._topics.get(topic_id)
        return 0 if topic is None else topic.policy.priority

    def _enqueue(
        self,
        topic_id: int,
        payload: bytes,
        at: float,
        now: float,
        wishes: Overrides,
        bytes_per_s: float,
    ) -> str | None:
        qos, priority, dst, lifespan_s, age_s, receipt, key = wishes
        topic = self._topics[topic_id]
        dst = topic.dst if dst is None else dst
        policy = topic.policy_to(dst)
        qos = QOS_BY_LABEL[policy.qos] if qos is None else qos
        if lifespan_s is None:
            lifespan_s = lifespan_of(policy, qos, self._classes).seconds
        if age_s <= UNLIKELY_AGE_S or lifespan_s < inf:
            at -= age_s
        frame = topic.deflated.shrink(payload) if topic.deflated else None
        if frame is not None and not self._may_inflate(topic, len(frame), len(payload)):
            frame = None
        if frame is not None:
            payload = frame
        wants_stamp = topic.stamps(policy) or (bool(receipt) and self._has_control)
        number, parting = self._own.number(topic_id, key), None
        if len(payload) > max_size(self._pdu_size, number):
            parting = self._parting(topic, number, len(payload), qos, wants_stamp)
            if parting is None:
                topic.tally.drop("tx_too_big")
                return "tx_too_big"
        message = Outgoing(
            topic_id,
            payload,
            qos,
            policy.priority if priority is None else priority,
            dst,
            at,
            at + lifespan_s,
            wants_stamp,
            topic.tally,
            # Without a control channel its receipt was already answered as unknown.
            receipt=receipt if self._has_control else "",
            key=key or key_of(payload, policy),
            number=number,
            parting=parting,
            is_command=qos is Qos.URGENT or policy.deadman_s > 0,
            is_compressed=frame is not None,
        )
        if message.expires_at <= now:
            # An expired message must not displace a fresh one.
            self._outbox.lives.drop(message, "tx_expired")
            return "tx_expired"
        needs = len(payload) / (message.expires_at - now)
        if message.is_command and needs > bytes_per_s:
            # It would take the air from others in vain.
            topic.needed_bytes_per_s = needs
            self._outbox.lives.drop(message, "tx_too_slow")
            return "tx_too_slow"
        return self._outbox.put(message, policy, bytes_per_s)

    def _may_inflate(self, topic: TopicState, frame: int, size: int) -> bool:
        """Whether receivers take a message of `size` octets in a frame of `frame` octets."""
        return self._is_sealed or bool(topic.policy.max_bytes) or size <= most_expanded(frame)

    def _parting(
        self, topic: TopicState, number: int, size: int, qos: Qos, wants_stamp: bool
    ) -> Parting | None:
        """How to divide a message that is too large for 255 fragments; None: it cannot be sent."""
        share = self._classes.of(qos).parity
        if not self._has_numbers or size > max_large_size(self._pdu_size, share):
            return None
        # Of equal size, as parity protects a small last part less.
        n = -(-size // part_size(self._pdu_size, share))
        return Parting(-(-size // n), octet(number), topic.count_large(), wants_stamp)
