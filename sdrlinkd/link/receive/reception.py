"""Everything between a PDU heard and a message handed over, by one door."""

from collections.abc import Hashable

from sdrlinkd.link.params import LinkParams, ReassemblyParams
from sdrlinkd.link.queue import Inflated, TopicPolicy
from sdrlinkd.link.receive.acceptance import Acceptance
from sdrlinkd.link.receive.air_heard import AirHeard
from sdrlinkd.link.receive.delivered import Delivered
from sdrlinkd.link.receive.events import Event
from sdrlinkd.link.receive.handover import AgeReport, Handover
from sdrlinkd.link.receive.inbox import Inbox
from sdrlinkd.link.receive.neighbors import Neighbors
from sdrlinkd.link.receive.relay import Relay, RelayParams
from sdrlinkd.link.receive.rx_ledger import RxLedger
from sdrlinkd.reports import ReceivedTopicReport, RxReport
from sdrlinkd.wire import Registry, Waits


class Reception:
    """Inbox, handover, neighbors, and the RX ledger of one node.

    A compressed message may grow to its topic's `max_bytes`, else to `max_expanded`.
    """

    def __init__(
        self,
        params: LinkParams,
        reassembly: ReassemblyParams,
        registry: Registry,
        own_id: int,
        relay: RelayParams,
        inflated: Inflated,
        max_expanded: int,
        hears_self: bool,
    ) -> None:
        self._own_src = bytes((own_id,))
        self.neighbors = Neighbors(own_id)
        """Who is heard, and how well."""
        self._relay = Relay(relay, own_id)
        self._acceptance = Acceptance(registry, inflated, max_expanded)
        self._ledger = RxLedger(registry)
        self._inbox = Inbox(
            params, reassembly, registry, own_id, hears_self, self.neighbors, self._relay,
            self._acceptance, self._ledger,
        )  # fmt: skip
        self._handover = Handover()
        self._air = AirHeard()

    def hear(
        self, data: bytes, at: float, snr_db: float | None, now: float, ended_at: float
    ) -> list[Event]:
        """Take a PDU whose burst's preamble arrived at `at`, and whose last sample at `ended_at`;
        what follows from it.
        """
        if data[1:2] != self._own_src:
            self._air.add(at, ended_at)
        return self._inbox.hear(data, at, snr_db, now, ended_at)

    def expire(self, now: float) -> list[Event]:
        """Give up what has waited too long; the messages whose senders want to know of it."""
        return self._inbox.expire(now)

    def relay_refused(self) -> None:
        """Take one PDU back from rx_relayed to rx_not_for_us: the queue refused it."""
        self._ledger.relay_refused()

    def deliver(self, message: Delivered, now: float) -> float | None:
        """Note that `message` is handed over at `now`; its age in s, None when unknown."""
        return self._handover.deliver(message, self._acceptance.policy(message.topic_id), now)

    def set_policy(self, topic_id: int, policy: TopicPolicy) -> None:
        """Treat messages of a topic by `policy` from now on."""
        self._acceptance.set_policy(topic_id, policy)
        if not policy.deadman_s:
            self._handover.forget(topic_id)

    def take_waits(self, src: int, waits: Waits) -> None:
        """Remember what robot `src` tells of the waits of one of its topics."""
        self._handover.take_waits(src, waits)

    @property
    def silence_at(self) -> float:
        """When the first command topic falls silent, if nothing comes before; s."""
        return self._handover.silence_at

    def take_silent(self, now: float) -> list[tuple[int, int]]:
        """(source, topic id) of command topics that fell silent, each once."""
        return self._handover.take_silent(now)

    @property
    def relays(self) -> bool:
        """Whether PDUs of others are forwarded."""
        return self._relay.is_on

    @property
    def holds_parts(self) -> bool:
        """Whether messages of others wait for the rest of them."""
        return self._inbox.held.held > 0

    @property
    def heard_s(self) -> float:
        """Airtime of others' bursts, in s."""
        return self._air.heard_s

    @property
    def fragments_repaired(self) -> int:
        """Fragments computed from parity so far."""
        return self._ledger.fragments_repaired

    def report(self) -> RxReport:
        """The RX half of the ledger."""
        return self._ledger.report(self._inbox.held)

    def report_topics(self) -> list[ReceivedTopicReport]:
        """Each topic of each source, but for rates, ages, and names on the bus."""
        return self._ledger.report_topics()

    def report_ages(self, src: int, topic_id: int) -> AgeReport:
        """How late messages of a topic of robot `src` came, and why."""
        return self._handover.report(src, topic_id)

    def counters(self) -> dict[Hashable, int]:
        """The counters of which people are shown rates."""
        return {**self._ledger.counters(), **self.neighbors.counters()}

    def audit(self) -> list[str]:
        """What does not add up in the RX ledgers; empty when all does."""
        return self._ledger.audit(self._inbox.held)
