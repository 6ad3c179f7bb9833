"""The receive side as one object, from a PDU heard to a message handed over."""

from collections.abc import Hashable

from sdrlinkd.link.params import LinkParams, ReassemblyParams
from sdrlinkd.link.queue import Inflated, PolicyTable, TopicPolicy
from sdrlinkd.link.receive.acceptance import Acceptance
from sdrlinkd.link.receive.air_heard import AirHeard
from sdrlinkd.link.receive.completion import Completion
from sdrlinkd.link.receive.delivered import Delivered, Retain
from sdrlinkd.link.receive.door import Door
from sdrlinkd.link.receive.events import Event, Signal
from sdrlinkd.link.receive.handover import AgeReport, Handover
from sdrlinkd.link.receive.inbox import Inbox
from sdrlinkd.link.receive.neighbors import Neighbors
from sdrlinkd.link.receive.recorded import OwnPdus, RecentCommands
from sdrlinkd.link.receive.repeated import RepeatedPdus
from sdrlinkd.link.receive.rx_ledger import RxLedger
from sdrlinkd.link.routes import Routes
from sdrlinkd.link.topics import HeardTopics
from sdrlinkd.reports import ReceivedTopicReport, RxReport
from sdrlinkd.sealing import InTheClear, Sealing
from sdrlinkd.wire import Registry, Waits


class Reception:
    """Inbox, handover, neighbors and receive ledger of one node.

    A compressed message may expand to its topic's `max_bytes`, or by default to `max_expanded`.
    PDUs in the clear have `clear_size` octets, and those inside sealed ones `params.pdu_size`.
    """

    def __init__(
        self,
        params: LinkParams,
        reassembly: ReassemblyParams,
        registry: Registry,
        topics: HeardTopics,
        own_id: int,
        routes: Routes,
        inflated: Inflated,
        max_expanded: int,
        hears_self: bool,
        sealing: Sealing | InTheClear,
        clear_size: int,
    ) -> None:
        self._own_src = bytes((own_id,))
        self.neighbors = Neighbors(own_id)
        """The robots that are heard."""
        self._topics = topics
        self._acceptance = Acceptance(
            registry, inflated, max_expanded, sealing.opener.delivers_unproven, sealing.is_on
        )
        self._ledger = RxLedger(topics)
        self.own_pdus = OwnPdus()
        """What this robot sent lately."""
        repeated = self._repeated = RepeatedPdus()
        self._door = Door(sealing, self._acceptance, self._ledger, self.neighbors, repeated, routes)
        self._commands = RecentCommands(self._acceptance, topics)
        completion = self._completion = Completion(
            topics, self._acceptance, self._ledger, self.neighbors
        )
        self._inbox = Inbox(
            params, reassembly, registry, own_id, hears_self, self.neighbors, routes,
            self._acceptance, self._ledger, topics, completion, repeated,
            self.own_pdus, self._commands, clear_size,
        )  # fmt: skip
        self._handover = Handover()
        self._air = AirHeard()

    def hear(
        self, data: bytes, at: float, signal: Signal, now: float, ended_at: float
    ) -> list[Event]:
        """Take a PDU and return the events that follow from it.

        The preamble of its burst arrived at `at`, and the PDU's last sample at `ended_at`.
        """
        if data[1:2] != self._own_src:
            self._air.add(at, ended_at)
        events: list[Event] = []
        for admitted in self._door.admit(data, at, signal, now, ended_at):
            events += self._inbox.hear(admitted, now)
        return events

    def expire(self, now: float) -> list[Event]:
        """Give up messages that have waited too long.

        Returns events for those whose senders want receipts.
        """
        self._door.expire(now)
        return self._inbox.expire(now)

    def begin_anew(self) -> None:
        """Go on with another clock; what was heard lately is not known again."""
        self._repeated.clear()
        self._commands.begin_anew()
        self.own_pdus.begin_anew()
        self._completion.begin_anew()
        for neighbor in self.neighbors:
            neighbor.track.begin_anew()

    def relay_refused(self) -> None:
        """Move one PDU from rx_relayed to rx_not_for_us, as the queue refused it."""
        self._ledger.relay_refused()

    def relayed_after_all(self) -> None:
        """Move one PDU from rx_not_for_us to rx_relayed, as it is forwarded later."""
        self._ledger.relayed_after_all()

    def deliver(self, message: Delivered, now: float) -> float | None:
        """Note that `message` is handed over at `now`; returns its age in s, None if unknown."""
        policy = self._acceptance.policy_of(message.topic, to_one=message.to_one)
        return self._handover.deliver(message, policy, now)

    def retain(self, message: Delivered) -> Retain:
        """How many messages of this one's topic and source are kept for later consumers."""
        return self._acceptance.retain(message.topic)

    def set_table(self, table: PolicyTable) -> None:
        """Treat messages of declared topics by the policies of `table` from now on."""
        self._acceptance.set_table(table)

    def set_policy(
        self, topic_id: int, policy: TopicPolicy, command: TopicPolicy | None = None
    ) -> None:
        """Treat messages of a topic by `policy` from now on.

        `command` is for messages that are sent to one robot; None: the same.
        """
        self._acceptance.set_policy(topic_id, policy, command)
        if not (policy.deadman_s or (command or policy).deadman_s):
            self._handover.forget(topic_id)

    def take_waits(self, src: int, waits: Waits) -> None:
        """Remember the WAITS record of robot `src` on one of its topics."""
        topic = self._topics.topic(src, waits.topic_id)
        if topic is not None:
            self._handover.take_waits(src, waits._replace(topic_id=topic.base))

    @property
    def silence_at(self) -> float:
        """Time in s at which the next command topic falls silent unless a message arrives."""
        return self._handover.silence_at

    def take_silent(self, now: float) -> list[tuple[int, int]]:
        """(source, topic id) of command topics that fell silent, each once."""
        return self._handover.take_silent(now)

    def holds(self, src: int, topic_id: int, entry_id: int) -> bool:
        """Whether fragments of a message are held that lacks others."""
        return self._inbox.holds(src, topic_id, entry_id)

    @property
    def holds_parts(self) -> bool:
        """Whether incomplete messages from others wait for more fragments."""
        return self._inbox.held.held > 0

    @property
    def heard_s(self) -> float:
        """Airtime of bursts heard from others, in s."""
        return self._air.heard_s

    @property
    def fragments_repaired(self) -> int:
        """Number of lost fragments computed from parity so far."""
        return self._ledger.fragments_repaired

    def report(self) -> RxReport:
        """The report on the receive ledger."""
        return self._ledger.report(self._inbox.held)

    def report_topics(self) -> list[ReceivedTopicReport]:
        """Reports on each topic of each source, without rates, ages and bus names."""
        return self._ledger.report_topics()

    def report_ages(self, src: int, topic_id: int) -> AgeReport:
        """How late messages of a topic from robot `src` arrived, and why."""
        return self._handover.report(src, topic_id)

    def counters(self) -> dict[Hashable, int]:
        """The counters for which rates are reported."""
        return {**self._ledger.counters(), **self.neighbors.counters()}

    def audit(self) -> list[str]:
        """Discrepancies in the receive ledgers, as sentences; empty when they add up."""
        return self._ledger.audit(self._inbox.held)
