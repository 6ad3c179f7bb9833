"""The link: one node's whole traffic, as a calculator over bytes and `now`."""

from collections.abc import Hashable, Mapping
from random import Random

from zstandard import ZstdCompressionDict

from sdrlinkd.link.access import Access, AccessParams
from sdrlinkd.link.beacons import Beacons
from sdrlinkd.link.burst import Burst, Outcome
from sdrlinkd.link.carrier import CarrierTraits, Opportunity
from sdrlinkd.link.compression import Inflated
from sdrlinkd.link.departures import Departures
from sdrlinkd.link.inbox import Delivered, Inbox
from sdrlinkd.link.latched import Kept, Latched
from sdrlinkd.link.meters import RateMeter, RecentAges
from sdrlinkd.link.params import LinkParams, QueueParams, ReassemblyParams
from sdrlinkd.link.policy import DEFAULT_POLICY, TopicPolicy
from sdrlinkd.link.qos import AS_CONFIGURED, CLASSES, Overrides, Qos
from sdrlinkd.link.rate import RateControl, RateParams
from sdrlinkd.link.relay import Relay, RelayParams
from sdrlinkd.link.schedule import ClassesParams
from sdrlinkd.link.sender import Sender
from sdrlinkd.link.why import Told, Why
from sdrlinkd.reports import RATE_WINDOW_S
from sdrlinkd.wire import CONTROL_TOPIC_ID, Frame, LinkReport, Pdu, Record, Registry, Stamp

NO_DICTIONARIES: Mapping[int, ZstdCompressionDict] = {}
NO_RELAY = RelayParams()
DEFAULT_CLASSES = ClassesParams()


class Link:
    """Joins sender and inbox, access and rate. Never waits, never reads a clock.

    `now`, `start` and `at` are seconds on one clock of the caller's choice; `rng` is the only
    chance. `hears_self` is the paper's loopback experiment; a compressed message may grow to
    `max_expanded` bytes.
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
        dictionaries: Mapping[int, ZstdCompressionDict] = NO_DICTIONARIES,
        hears_self: bool = False,
        max_expanded: int = 1 << 20,
    ) -> None:
        self.params = params
        self.registry = registry
        self.own_id = own_id
        self.digest = registry.digest({i: each.dict_id() for i, each in dictionaries.items()})
        self.sender = Sender(
            params, queue, registry, own_id, rng, reassembly.timeout_s, classes, dictionaries
        )
        self.inbox = Inbox(
            params,
            reassembly,
            registry,
            own_id,
            hears_self,
            self,
            Inflated(dictionaries),
            max_expanded,
        )
        self.rates = RateMeter(RATE_WINDOW_S)
        self.ages: dict[tuple[int, int], RecentAges] = {}
        period_s = params.beacon_s if registry.has_control else 0.0
        beacons = Beacons(period_s, params.pdu_size, self.digest, rng, own_id)
        self.departures = Departures(
            self.sender, self.inbox, beacons, classes, own_id, registry.has_control, rng
        )
        self._latched = Latched()
        self._why = Why(self.sender, self.departures.shares)
        self.relay = Relay(relay, own_id)

    def attach(self, carrier: CarrierTraits, access: AccessParams, rate: RateParams) -> None:
        """Settle access and rate for the radio that is there. Raises ConfigError."""
        self.departures.attach(carrier, access, rate)

    @property
    def access(self) -> Access:
        """Says when."""
        return self.departures.access

    @property
    def rate(self) -> RateControl:
        """Says how fast."""
        return self.departures.rate

    def set_policies(self, policies: Mapping[int, TopicPolicy]) -> None:
        """Apply per-topic policies by topic id; the others get the defaults."""
        for topic in self.registry.topics:
            self.set_policy(topic.id, policies.get(topic.id, DEFAULT_POLICY))

    def set_policy(self, topic_id: int, policy: TopicPolicy) -> None:
        """Change one, from now on."""
        self.sender.set_policy(topic_id, policy)
        if policy.durability == "volatile":
            self._latched.forget(topic_id)
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
        if refused is None:
            qos = self.sender.treatment(topic_id)[0] if overrides.qos is None else overrides.qos
            self.departures.forecasts.note((self.own_id, topic_id), qos, now)
            self.departures.more_to_send()
            if self.sender.policy(topic_id).durability == "transient_local":
                self._latched.keep(topic_id, Kept(payload, now, overrides))
        return refused

    def next_burst(self, opportunity: Opportunity) -> Burst | None:
        """The burst that should leave next, decided now; None: nothing to send, or not yet."""
        return self.departures.next_burst(opportunity)

    def confirm(self, burst: Burst, outcome: Outcome, now: float) -> None:
        """What the radio says became of a burst."""
        self.departures.confirm(burst, outcome, now)

    def hear(
        self, data: bytes, at: float, snr_db: float | None = None, now: float | None = None
    ) -> list[Delivered]:
        """Take a PDU whose burst's preamble arrived at `at`; the messages that it completed.

        Absent `now` is `at`.
        """
        return self.inbox.hear(data, at, snr_db, at if now is None else now)

    def delivered(self, message: Delivered, now: float) -> float | None:
        """The age in seconds at which `message` is handed over at `now`; None when unknown."""
        if message.origin_at is None:
            return None
        age_s = now - message.origin_at
        key = (message.src, message.topic_id)
        ages = self.ages.get(key)
        if ages is None:
            ages = self.ages[key] = RecentAges()
        ages.add(age_s)
        return age_s

    def handle_timers(self, now: float) -> None:
        """Let time pass: expiries, reassembly timeouts, rate samples."""
        self.sender.expire(now)
        for offer in self._latched.due(now, self.sender.outbox.bytes_per_s):
            self.sender.offer_again(offer, now)
            self.departures.more_to_send()
        self.inbox.expire(now)
        self._why.sample(now, len(self.registry))
        if self.rates.is_due(now):
            self.rates.sample(self.rate_counters(), now)

    @property
    def has_work(self) -> bool:
        """Whether messages wait to be sent."""
        return self.departures.has_work

    def next_wakeup(self, now: float) -> float:
        """When there may next be something to send; not after `now`: at once."""
        return self.departures.next_wakeup(now)

    def drain(self) -> None:
        """Nothing more will come: partial PDUs go at once, beacons end."""
        self.departures.drain()

    def shut_down(self) -> None:
        """Drop what could not be sent any more, by name."""
        self.departures.clear()
        self.sender.shut_down()

    def audit(self) -> list[str]:
        """Where the ledger does not add up; empty when it does."""
        return self.sender.audit() + self.inbox.audit()

    def rate_counters(self) -> dict[Hashable, int]:
        """The counters of which the snapshot shows rates."""
        tx: dict[Hashable, int] = {
            ("tx", topic.id): self.sender.tally(topic.id).accepted for topic in self.registry.topics
        }
        rx: dict[Hashable, int] = {
            ("rx", *key): tally.delivered for key, tally in self.inbox.tallies.items()
        }
        return {**tx, **rx}

    # The inbox's ear.

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
                self.departures.forecasts.note((src, entry.topic_id), qos, origin)

    def newcomer(self, src: int, at: float) -> None:
        """It does not have what was latched before."""
        if src != self.own_id:
            self._latched.newcomer(src, at)

    def sends_on(self, pdu: Pdu, data: bytes, at: float) -> bool:
        """Forward it, if that is our part."""
        if not self.relay.wants(pdu):
            return False
        refused = self.sender.forward(pdu, data, at, at + self.relay.lifespan_s)
        self.departures.more_to_send()
        return refused is None

    def record_from(self, src: int, record: Record, at: float) -> None:
        """A control record that is not about messages."""
        if isinstance(record, LinkReport):
            if record.node == self.own_id:
                self.rate.take(src, record, at)
            else:
                self.access.told_of(record.node, at)
        elif isinstance(record, Frame):
            self.access.take_frame(src, record, at)
