"""The link: one node's whole traffic, as a calculator over bytes and `now`."""

from collections.abc import Mapping
from random import Random

from zstandard import ZstdCompressionDict

from sdrlinkd.link.access import Access, AccessParams
from sdrlinkd.link.carrier import CarrierTraits, Opportunity
from sdrlinkd.link.params import LinkParams, QueueParams, ReassemblyParams
from sdrlinkd.link.qos import AS_CONFIGURED, CLASSES, Overrides, Qos
from sdrlinkd.link.queue import DEFAULT_POLICY, NOT_TAKEN, Inflated, Kept, Latched, TopicPolicy
from sdrlinkd.link.receipts import Delivery
from sdrlinkd.link.receive import Delivered, Inbox, Relay, RelayParams
from sdrlinkd.link.schedule import ClassesParams
from sdrlinkd.link.status import RateMeter, Told, Why, rate_counters
from sdrlinkd.link.timesync import ClockParams, Clocks
from sdrlinkd.link.transmit import (
    AirUse,
    Beacons,
    Burst,
    BurstScheduler,
    ControlRecords,
    Outcome,
    RateControl,
    RateParams,
    Sender,
)
from sdrlinkd.reports import RATE_WINDOW_S
from sdrlinkd.wire import (
    CONTROL_TOPIC_ID,
    Beacon,
    Clock,
    Frame,
    LinkReport,
    Pdu,
    Receipt,
    Record,
    Registry,
    Stamp,
    Waits,
)

NO_DICTIONARIES: Mapping[int, ZstdCompressionDict] = {}
NO_RELAY = RelayParams()
NO_CLOCK = ClockParams(period_s=0.0)
DEFAULT_CLASSES = ClassesParams()


class Link:
    """Joins sender and inbox, access and rate. Never waits, never reads a clock.

    `now`, `start` and `at` are seconds on one clock of the caller's choice; `rng` is all chance.
    `hears_self`: the paper's loopback experiment. A compressed message may grow to `max_expanded`.
    """

    def __init__(
        self,
        params: LinkParams,
        queue: QueueParams,
        reassembly: ReassemblyParams,
        registry: Registry,
        own_id: int,
        rng: Random,
        *,
        classes: ClassesParams = DEFAULT_CLASSES,
        relay: RelayParams = NO_RELAY,
        clock: ClockParams = NO_CLOCK,
        dictionaries: Mapping[int, ZstdCompressionDict] = NO_DICTIONARIES,
        hears_self: bool = False,
        max_expanded: int = 1 << 20,
    ) -> None:
        self.params = params
        self.registry = registry
        self.own_id = own_id
        self._own_src = bytes((own_id,))
        self.digest = registry.digest({i: each.dict_id() for i, each in dictionaries.items()})
        self.sender = Sender(
            params, queue, registry, own_id, rng, reassembly.timeout_s, classes, dictionaries
        )
        self.inbox = Inbox(
            params, reassembly, registry, own_id, hears_self, self, Inflated(dictionaries),
            max_expanded,
        )  # fmt: skip
        self.rates = RateMeter(RATE_WINDOW_S)
        self.waits_records: dict[tuple[int, int], Waits] = {}
        """Why messages waited at their source, as that tells: by (source, topic id)."""
        period_s = params.beacon_s if registry.has_control else 0.0
        beacons = Beacons(period_s, params.pdu_size, self.digest, rng, own_id)
        if not registry.has_control:
            clock = NO_CLOCK
        self.clocks = Clocks(clock, beacons.boot_id, own_id)
        piggyback, neighbors = self.sender.packetizer.piggyback, self.inbox.neighbors
        room = self.sender.packetizer.k_single
        self.control_records = ControlRecords(clock, self.clocks, piggyback, neighbors, room)
        self.scheduler = BurstScheduler(
            self.sender, self.inbox, beacons, self.control_records, classes, own_id,
            registry.has_control, rng,
        )  # fmt: skip
        self.delivery = Delivery(
            self.sender, self.control_records, neighbors, own_id, params.receipt_s
        )
        self._latched = Latched()
        self.air = AirUse(self.scheduler)
        self._why = Why(self.sender, self.scheduler.shares, self.air)
        self.relay = Relay(relay, own_id)

    def attach(self, carrier: CarrierTraits, access: AccessParams, rate: RateParams) -> None:
        """Settle access and rate for the radio that is there. Raises ConfigError."""
        self.scheduler.attach(carrier, access, rate)
        if carrier.is_lockstep:
            # Its time begins now, whatever ours was.
            self.sender.begin_anew()
        self.clocks.resolution_s = carrier.stamp_s

    @property
    def access(self) -> Access:
        """Says when."""
        return self.scheduler.access

    @property
    def rate(self) -> RateControl:
        """Says how fast."""
        return self.scheduler.rate

    def set_policies(self, policies: Mapping[int, TopicPolicy]) -> None:
        """Apply per-topic policies by topic id; the others get the defaults."""
        for topic in self.registry.topics:
            self.set_policy(topic.id, policies.get(topic.id, DEFAULT_POLICY))

    def set_policy(self, topic_id: int, policy: TopicPolicy) -> None:
        """Change one, from now on."""
        self.sender.set_policy(topic_id, policy)
        if policy.durability == "volatile":
            self._latched.forget(topic_id)
        if not policy.deadman_s:
            self.delivery.deadman.forget(topic_id)
        self.inbox.policies[topic_id] = policy

    def why(self, topic_id: int, told: Told, now: float) -> list[str]:
        """What happens to a topic, in plain words."""
        return self._why.explain(topic_id, self.registry.topics[topic_id].name, told, now)

    def submit(
        self,
        topic_id: int,
        payload: bytes,
        now: float,
        overrides: Overrides = AS_CONFIGURED,
    ) -> str | None:
        """Queue a message; None, or the ledger's reason for refusing it."""
        refused = self.sender.submit(topic_id, payload, now, overrides)
        if overrides.receipt:
            self.delivery.note(now)
            if refused in NOT_TAKEN or (refused and not self.registry.has_control):
                self.delivery.refused(overrides.receipt, topic_id, refused, overrides.dst)
            elif refused is None and not self.registry.has_control:
                self.delivery.unknowable(overrides.receipt, topic_id, overrides.dst)
        if refused is None:
            qos = overrides.qos if overrides.qos is not None else self.sender.treatment(topic_id)[0]
            self.scheduler.forecasts.note((self.own_id, topic_id), qos, now)
            self.scheduler.more_to_send()
            if self.sender.policy(topic_id).durability == "transient_local":
                self._latched.keep(topic_id, Kept(payload, now, overrides._replace(receipt="")))
        return refused

    def next_burst(self, opportunity: Opportunity) -> Burst | None:
        """The burst that should leave next, decided now; None: nothing to send, or not yet."""
        burst = self.scheduler.next_burst(opportunity)
        if burst is not None and self.sender.packetizer.asking:
            self.delivery.note(burst.start)
        return burst

    def confirm(self, burst: Burst, outcome: Outcome, now: float) -> None:
        """What the radio says became of a burst."""
        self.scheduler.confirm(burst, outcome, now)
        if self.sender.lives.dropped_asking:
            self.delivery.note(now)

    def hear(
        self,
        data: bytes,
        at: float,
        snr_db: float | None = None,
        now: float | None = None,
        ended_at: float | None = None,
    ) -> list[Delivered]:
        """Take a PDU whose burst's preamble arrived at `at`, and whose last sample at `ended_at`
        (absent: `at`, as is `now`); the messages that it completed.
        """
        now, ended_at = at if now is None else now, at if ended_at is None else ended_at
        if data[1:2] != self._own_src:
            self.air.heard(at, ended_at)
        return self.inbox.hear(data, at, snr_db, now, ended_at)

    def delivered(self, message: Delivered, now: float) -> float | None:
        """The age in seconds at which `message` is handed over at `now`; None when unknown."""
        policy = self.inbox.policies.get(message.topic_id, DEFAULT_POLICY)
        return self.delivery.delivered(message, policy, now)

    def expire_queue(self, now: float) -> None:
        """Let time pass where there is nothing yet to send with: what is too old goes by name."""
        self.sender.expire(now)
        self.delivery.expire(now)

    def handle_timers(self, now: float) -> None:
        """Let time pass: expiries, reassembly timeouts, rate samples."""
        self.sender.expire(now)
        for offer in self._latched.due(now, self.sender.outbox.bytes_per_s):
            self.sender.offer_again(offer, now)
            self.scheduler.more_to_send()
        self.inbox.expire(now)
        self.control_records.look_round(now, self.own_id)
        self.delivery.expire(now)
        self._why.sample(now, len(self.registry))
        if self.rates.is_due(now):
            counters = rate_counters(self.sender, self.inbox, self.air.sent_s, self.air.heard_s)
            self.rates.sample(counters, now)

    @property
    def has_work(self) -> bool:
        """Whether messages wait to be sent."""
        return self.scheduler.has_work

    def next_wakeup(self, now: float) -> float:
        """When there may next be something to send; not after `now`: at once."""
        return self.scheduler.next_wakeup(now)

    def drain(self) -> None:
        """Nothing more will come: partial PDUs go at once, beacons end."""
        self.scheduler.drain()

    def shut_down(self) -> None:
        """Drop what could not be sent any more, by name."""
        self.scheduler.clear()
        self.sender.shut_down()
        self.delivery.expire(float("inf"))

    def audit(self) -> list[str]:
        """Where the ledger does not add up; empty when it does."""
        return self.sender.audit() + self.inbox.audit()

    # What the inbox tells.

    def ended(
        self, src: int, topic_id: int, entry_id: int, reason: str, age_s: float | None, now: float
    ) -> None:
        """Its sender wants to know."""
        self.delivery.ended(src, topic_id, entry_id, reason, age_s, now)

    def pdu_from(self, pdu: Pdu, stamps: list[Stamp], at: float, is_relayed: bool) -> None:
        """A good PDU that somebody else has sent."""
        src = pdu.src
        self.access.heard(src, at, is_relayed)
        if not is_relayed:
            self.rate.heard(src, at)
        qos = CLASSES[pdu.qos]
        if not self.access.others_follow or qos > Qos.LATENCY or src == self.own_id:
            return
        # What others send at their beat needs the air then, too.
        ages = {} if is_relayed else {(each.topic_id, each.entry_id): each for each in stamps}
        for entry in pdu.entries:
            if not entry.index and not (
                entry.topic_id == CONTROL_TOPIC_ID and self.registry.has_control
            ):
                stamp = ages.get((entry.topic_id, entry.entry_id))
                origin = at if stamp is None else at - 1e-6 * stamp.age_us
                self.scheduler.forecasts.note((src, entry.topic_id), qos, origin)

    def newcomer(self, src: int, at: float) -> None:
        """It does not have what was latched before."""
        if src != self.own_id:
            self._latched.newcomer(src, at)

    def sends_on(self, pdu: Pdu, data: bytes, at: float) -> bool:
        """Forward it, if that is our part."""
        if not self.relay.wants(pdu):
            return False
        until = min(at + self.relay.lifespan_s, self.inbox.fresh_until(pdu))
        refused = self.sender.forward(pdu, data, at, until)
        self.scheduler.more_to_send()
        return refused is None

    def record_from(self, src: int, record: Record, at: float) -> None:
        """A control record that is not about messages."""
        if isinstance(record, LinkReport):
            if record.node == self.own_id:
                self.rate.take(src, record, at)
            else:
                self.access.told_of(record.node, at)
        elif isinstance(record, Beacon):
            self.access.beacon(src, at)
        elif isinstance(record, Frame):
            self.access.take_frame(src, record, at)
        elif isinstance(record, Clock) and src != self.own_id:
            self.clocks.hear(src, record, at)
        elif isinstance(record, Receipt):
            self.delivery.answered(src, record, at)
        elif isinstance(record, Waits) and record.topic_id < len(self.registry):
            self.waits_records[src, record.topic_id] = record
