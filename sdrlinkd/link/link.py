"""The link: all traffic of one node, computed from bytes and `now`, without waiting or I/O."""

from collections.abc import Collection, Mapping, Sequence
from math import inf
from random import Random

import msgspec
from zstandard import ZstdCompressionDict

from sdrlinkd.errors import ConfigError
from sdrlinkd.link.access import AccessParams
from sdrlinkd.link.packing import Composer, PiggybackRecords
from sdrlinkd.link.params import LinkParams, QueueParams, ReassemblyParams
from sdrlinkd.link.paths import Edges
from sdrlinkd.link.qos import AS_CONFIGURED, Overrides, Qos
from sdrlinkd.link.queue import (
    DEFAULT_POLICY,
    NOT_TAKEN,
    Inflated,
    Intake,
    Kept,
    Latched,
    Outbox,
    PolicyTable,
    TopicPolicy,
)
from sdrlinkd.link.receipts import Receipts, Verdict, make_receipt
from sdrlinkd.link.receive import (
    HEAD,
    TAIL,
    Delivered,
    Ended,
    Event,
    Newcomer,
    PduHeard,
    PduPlaced,
    Reception,
    RecordHeard,
    Retain,
    Signal,
    can_be_true,
)
from sdrlinkd.link.repeat import Answers, Asking, RepeatParams
from sdrlinkd.link.report import NO_NAMES, Names, Reporter
from sdrlinkd.link.routes import Again, PduToRelay, RelayParams, Routes
from sdrlinkd.link.schedule import AdmissionParams, ClassesParams, Flow, Forecasts, TeamAir
from sdrlinkd.link.status import AirUse, Told, Why, reserved_words
from sdrlinkd.link.timesync import ClockParams, Clocks, Estimate, State, Wall
from sdrlinkd.link.topics import (
    NOTHING,
    Demand,
    HeardTopic,
    HeardTopics,
    Offer,
    OwnTopics,
    TopicTeller,
    Wants,
)
from sdrlinkd.link.traits import Opportunity, PduLinkTraits
from sdrlinkd.link.transmit import (
    Beacons,
    Burst,
    BurstScheduler,
    ControlRecords,
    Fit,
    NoRadio,
    Outcome,
    OwnFlows,
    RateParams,
    TxDelayMeters,
    fit_to,
)
from sdrlinkd.reports import LinkReport
from sdrlinkd.sealing import InTheClear, Sealing
from sdrlinkd.wire import (
    FIRST_NUMBER,
    MAX_VALUE_SIZE,
    PDU_NUMBERS,
    TLV_HEADER_SIZE,
    TOPIC_OVERHEAD,
    WANTED_OVERHEAD,
    Admit,
    Clock,
    Flows,
    Lsa,
    Need,
    RatesAsked,
    Receipt,
    Registry,
    Repeat,
    Route,
    Topic,
    Waits,
    Wanted,
    equal_payload,
    needs,
    octet,
)

NO_DICTIONARIES: Mapping[int, ZstdCompressionDict] = {}
NO_RELAY = RelayParams()
DEFAULT_ADMISSION = AdmissionParams()
NO_CLOCK = ClockParams(period_s=0.0)
NO_REPEAT = RepeatParams(share=0.0)
DEFAULT_CLASSES = ClassesParams()
NOTHING_NOTED: Mapping[int, str] = {}


class Link:
    """The link: joins the queue, the burst scheduler and the inbox; never waits or reads a clock.

    `now`, `start` and `at` are seconds on one clock of the caller's choice. `rng` is the only
    source of randomness. `hears_self` accepts our own PDUs, for the paper's loopback experiment.
    `has_numbers` lets producers declare topics beyond the registry, and send large messages.
    `max_expanded` is the largest size in bytes of a decompressed message. With `sealing`, PDUs are
    sealed. Messages may be submitted
    from the start; `attach` makes the parts that need a radio.
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
        repeat: RepeatParams = NO_REPEAT,
        admission: AdmissionParams = DEFAULT_ADMISSION,
        dictionaries: Mapping[int, ZstdCompressionDict] = NO_DICTIONARIES,
        hears_self: bool = False,
        has_numbers: bool = False,
        max_expanded: int = 1 << 20,
        sealing: Sealing | None = None,
    ) -> None:
        has_control = registry.has_control
        clear_size = params.pdu_size
        self.sealing = sealing or InTheClear(clear_size, has_control)
        # Everything but the door and the last step of a burst works on inner PDUs.
        params = msgspec.structs.replace(params, pdu_size=self.sealing.inner_size)
        self.params = params
        self.registry = registry
        self._clear_size = clear_size
        self.own_id = own_id
        self._rng = rng
        self._classes = classes
        digest = registry.digest({i: each.dict_id() for i, each in dictionaries.items()})
        self._outbox = Outbox(queue, params.pdu_size)
        room = equal_payload(params.pdu_size, 1)
        record = min(room, TLV_HEADER_SIZE + MAX_VALUE_SIZE)
        piece = record - TOPIC_OVERHEAD
        self._topics = OwnTopics(registry, has_numbers, piece)
        self._heard_topics = HeardTopics(registry, has_numbers, self._topics.hash_of)
        self._wants = Wants(record - WANTED_OVERHEAD)
        self._demand = Demand(self._topics)
        first_large = rng.randrange(1 << 16) if has_numbers else 0
        self._intake = Intake(
            params,
            self._topics,
            self._outbox,
            classes,
            dictionaries,
            first_large,
            is_sealed=self.sealing.is_on,
        )
        self._latched = Latched()
        self._piggyback = PiggybackRecords()
        self._composer = Composer(
            params, own_id, self._outbox, self._piggyback, rng, reassembly.timeout_s, has_control,
            classes,
        )  # fmt: skip
        self._routes = Routes(
            relay, own_id, params.hop_limit, self._composer.k_single, lambda: rng.randrange(1 << 16)
        )
        self._reception = Reception(
            params, reassembly, registry, self._heard_topics, own_id, self._routes,
            Inflated(dictionaries), max_expanded, hears_self, self.sealing, clear_size,
        )  # fmt: skip
        self._team_air = TeamAir(
            admission if has_control else AdmissionParams(share=0.0), own_id,
            self._composer.k_single, lambda: rng.randrange(1 << 16), relays=self._routes.is_auto,
        )  # fmt: skip
        self._own_flows = OwnFlows(self._topics, self._intake, classes, self._composer.k_single)
        self._team: frozenset[int] = frozenset()
        """The robots that the configuration names."""
        self._own_begins = self._reception.own_pdus.begins
        self._receipts = Receipts(own_id, params.receipt_s)
        beacons = Beacons(params.beacon_s if has_control else 0.0, params.pdu_size, digest, rng)
        clock = clock if has_control else NO_CLOCK
        self._clocks = Clocks(clock, beacons.boot_id, own_id)
        self._tx_delays = TxDelayMeters()
        self._asking = Asking(
            self._reception.holds, repeat.share if has_control else 0.0, self._composer.k_single
        )
        self._answers = Answers(
            repeat, own_id, self._composer.entry_ids, has_control=has_control,
            has_numbers=has_numbers, is_sealed=self.sealing.is_on,
            twice=[qos for qos in Qos if classes.of(qos).twice],
        )  # fmt: skip
        self._control_records = ControlRecords(
            clock, self._clocks, beacons, self._tx_delays, self._piggyback,
            self._reception.neighbors, TopicTeller(self._topics, piece), self._wants, self.sealing,
            self._asking, self._routes, self._composer.k_single, own_id, clear_size,
        )  # fmt: skip
        self._forecasts = Forecasts()
        self._fit: Fit | None = None
        self._scheduler: BurstScheduler | NoRadio = NoRadio()
        self._why = Why(self._intake, self._outbox)
        self._reporter = Reporter(
            self._topics, self._heard_topics, digest, self._outbox, self._intake,
            self._composer, self._control_records, self._tx_delays, self._reception, self._receipts,
            self._clocks, self.sealing, self._asking, self._answers, self._routes,
            self._team_air, own_id, clear_size,
        )  # fmt: skip

    # The radio.

    def attach(self, traits: PduLinkTraits, access: AccessParams, rate: RateParams) -> Fit:
        """Fit the link to a radio that is up. Raises ConfigError and then changes nothing."""
        room = self._composer.k_whole * self.registry.has_control
        fit = fit_to(traits, access, rate, self.own_id, self._rng, room)
        policy, least = fit.settled.policy, fit.settled.access.least_room
        missing = least - self._composer.k_whole
        if least and not self.registry.has_control:
            raise ConfigError(
                f'access.policy: got "{policy}", which tells what waits in records; 16 topics in '
                "the registry leave no number for them: allowed are 15"
            )
        if missing > 0:
            size = self._clear_size
            raise ConfigError(
                f'link.pdu_size: got {size}; allowed with access.policy = "{policy}": at least '
                f"{size + missing}, so that a PDU has room for its records"
            )
        self._team = frozenset(access.nodes)
        self.use(fit)
        return fit

    def use(self, fit: Fit) -> None:
        """Use the radio that `fit` describes from now on.

        `attach` derives `fit` from the radio's traits; callers may pass one with an access policy
        of their own.
        """
        self._fit = fit
        if fit.settled.access.needs_links:
            self._routes.tell_links()
        if isinstance(self._scheduler, NoRadio):
            self._scheduler = BurstScheduler(
                fit, self._outbox, self._composer, self._control_records, self._tx_delays,
                self._forecasts, self._classes, self.own_id, self.registry.has_control,
                self.sealing, self._answers, self._knows, self._clear_size,
                self._piggyback,
            )  # fmt: skip
        else:
            self._scheduler.refit(fit)
        self._scheduler.know_links(self._routes.take_links())
        if fit.is_lockstep:
            # The radio's time starts now, whatever our time was.
            self._outbox.drop_all("tx_radio_down")
            self._intake.begin_anew()
            self.sealing.begin_anew()
            self._answers.restart()
            self._asking.restart()
            self._routes.begin_anew()
            self._team_air.begin_anew()
            self._reception.begin_anew()
        self.sealing.opener.set_uncertainty(fit.stamp_s)
        self._clocks.set_resolution(fit.stamp_s)
        self._routes.set_needed_snr(fit.rate.least_snr_db)

    def next_burst(self, opportunity: Opportunity) -> Burst | None:
        """The burst that should leave next; None: nothing to send, or not yet."""
        burst = self._scheduler.next_burst(opportunity)
        if burst is not None:
            self._own_begins.extend([pdu[HEAD] + pdu[TAIL] for pdu in burst.pdus])
            if self._composer.asking:
                self._expect_receipts(burst.start)
                self._tell_dropped()
        return burst

    def next_wakeup(self, now: float) -> float:
        """Earliest time at which there may be something to send; if not after `now`: at once."""
        return self._scheduler.next_wakeup(now)

    def confirm(self, burst: Burst, outcome: Outcome, now: float) -> None:
        """Settle a burst by the outcome that the radio reports."""
        self._scheduler.confirm(burst, outcome, now)
        if outcome is Outcome.SENT and self._routes.is_auto:
            for octets, number, is_bare in burst.numbered():
                self._routes.sent(octets, number, now, is_bare=is_bare)
            self._tell_routes(now)
        self._tell_dropped()

    def hear(
        self,
        data: bytes,
        at: float,
        snr_db: float | None = None,
        now: float | None = None,
        ended_at: float | None = None,
        doppler_hz: float | None = None,
    ) -> list[Delivered]:
        """Take a PDU from the air, and return the messages that it completes.

        The preamble of its burst arrived at `at`, and the PDU's last sample at `ended_at`; `now`
        and `ended_at` default to `at`. `snr_db` and `doppler_hz` are those of the burst, if known.
        """
        now, ended_at = at if now is None else now, at if ended_at is None else ended_at
        delivered = self._dispatch(
            self._reception.hear(data, at, Signal(snr_db, doppler_hz), now, ended_at)
        )
        self._tell_routes(now)
        return delivered

    # The bus.

    def submit(
        self,
        topic_id: int,
        payload: bytes,
        now: float,
        overrides: Overrides = AS_CONFIGURED,
    ) -> str | None:
        """Queue a message; returns None, or the ledger's reason for refusing it."""
        intake, bytes_per_s = self._intake, self._scheduler.bytes_per_s
        overrides = intake.keyed(topic_id, payload, overrides)
        is_urgent = overrides.qos is Qos.URGENT
        is_admitted = is_urgent or not self._team_air.is_refused(octet(topic_id))
        refused = intake.submit(
            topic_id, payload, now, overrides, bytes_per_s, is_admitted=is_admitted
        )
        if overrides.receipt:
            self._tell_dropped()
            if refused in NOT_TAKEN or (refused and not self.registry.has_control):
                self._refused(overrides.receipt, topic_id, refused, overrides.dst)
            elif refused is None and not self.registry.has_control:
                dst = overrides.dst
                dst = intake.destination(topic_id) if dst is None else dst
                self._receipts.unknowable(overrides.receipt, topic_id, dst)
        if refused is None:
            qos = overrides.qos
            if qos is None:
                qos, _ = intake.treatment(topic_id, overrides.dst)
            flow, k = Flow(self.own_id, self.own_id, topic_id), self._composer.k_single
            self._forecasts.note(flow, qos, now, max(1, -(-len(payload) // k)))
            self._scheduler.more_to_send()
            if depth := intake.policy(topic_id).latched:
                kept = Kept(payload, now, overrides._replace(receipt=""))
                self._latched.keep(topic_id, kept, depth)
        return refused

    def refuse(
        self, reason: str, topic_id: int | None = None, receipt: str = "", dst: int | None = None
    ) -> None:
        """Count a message that the bus refused, and report it if its producer wants a receipt."""
        self._intake.refuse(reason, topic_id)
        if receipt and topic_id is not None:
            self._refused(receipt, topic_id, reason, dst)

    def delivered(self, message: Delivered, now: float) -> float | None:
        """Note that `message` is handed over at `now`; returns its age in s, None if unknown."""
        return self._reception.deliver(message, now)

    def retain(self, message: Delivered) -> Retain:
        """How many messages of this one's topic and source are kept for later consumers."""
        return self._reception.retain(message)

    def take_verdicts(self) -> list[Verdict]:
        """Verdicts since the last call on messages whose producers want receipts."""
        return self._receipts.take()

    @property
    def silence_at(self) -> float:
        """Time in s at which the next command topic falls silent unless a message arrives."""
        return self._reception.silence_at

    def take_silent(self, now: float) -> list[tuple[int, int]]:
        """(source, topic id) of command topics that fell silent, each once."""
        return self._reception.take_silent(now)

    # Topics.

    def declare(self, offer: Offer, now: float = 0.0) -> Topic:
        """The topic of a producer's offer, from which messages are taken from now on.

        It replaces one that contradicts it and is idle. Raises DeclarationError.
        """
        intake = self._intake
        known = self._topics.by_name(offer.name)
        topic = self._topics.declare(offer, lambda topic_id: intake.is_idle(topic_id, now))
        if known is not None and known.id != topic.id:
            self._latched.forget(known.id)
        intake.add(topic.id)
        intake.used(topic.id, now)
        self._scheduler.more_to_send()
        return topic

    def undeclare(self, topic_id: int) -> None:
        """Let another type have the topic's name at once, as its producers have ended."""
        self._intake.unused(topic_id)

    def topic(self, topic_id: int) -> Topic:
        """One of this robot's topics."""
        return self._topics[topic_id]

    def topic_named(self, name: str) -> Topic | None:
        """The topic of this robot called `name` (with or without leading slash), or None."""
        return self._topics.by_name(name)

    @property
    def own_topics(self) -> list[Topic]:
        """This robot's topics: those of the registry, and those declared since the start."""
        return list(self._topics)

    def heard_topic(self, src: int, topic_id: int) -> HeardTopic | None:
        """What a topic id of robot `src` means; None if that is not known (any more)."""
        return self._heard_topics.topic(src, topic_id)

    def heard_topics(self) -> dict[int, list[HeardTopic]]:
        """The topics that other robots declared, by source."""
        return self._heard_topics.declared()

    def heard_topics_of(self, src: int) -> list[HeardTopic]:
        """The topics that a robot declared."""
        return self._heard_topics.declared_by(src)

    def heard_versions(self) -> dict[int, int]:
        """By source, what `heard_version` was when what it declares changed last."""
        return self._heard_topics.versions()

    def take_changed_topics(self) -> list[tuple[int, int]]:
        """(source, number) of topics whose numbers have another meaning since the last call."""
        return self._heard_topics.take_changed()

    @property
    def heard_version(self) -> int:
        """Counts the changes of what other robots declare."""
        return self._heard_topics.version

    def want(
        self,
        wanted: Collection[tuple[int, int]],
        periods_s: Mapping[tuple[int, int], float] = NOTHING,
    ) -> None:
        """Tell other robots that consumers here subscribe to these topics, as (source, number).

        Of those in `periods_s`, a message in each period of so many s is enough.
        """
        self._wants.set(wanted, periods_s)
        own = [number for src, number in wanted if src == self.own_id]
        self._demand.want_own(self.own_id, own)

    def demand(self, now: float) -> dict[str, list[int]]:
        """The declared topics that other robots want at `now`, and which robots, by name."""
        return self._demand.wanted(now)

    # Policies and clocks.

    def set_policies(self, policies: Mapping[int, TopicPolicy]) -> None:
        """Apply per-topic policies by topic id; the others get the defaults."""
        for topic in self._topics:
            self.set_policy(topic.id, policies.get(topic.id, DEFAULT_POLICY))

    def set_table(self, table: PolicyTable) -> None:
        """Treat messages of topics that others declare by the policies of `table`."""
        self._reception.set_table(table)

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
        self._intake.set_policy(topic_id, policy, command, origin)
        if policy.durability == "volatile":
            self._latched.forget(topic_id)
        if topic_id < FIRST_NUMBER:
            self._reception.set_policy(topic_id, policy, command)
        else:
            self._topics.set_depth(topic_id, policy.latched)

    def policy(self, topic_id: int) -> TopicPolicy:
        """The policy in force for a topic."""
        return self._intake.policy(topic_id)

    def set_wall(self, wall: Wall) -> None:
        """Set the offset of our host's clock from the link's, to be announced to others."""
        self._clocks.set_wall(wall)

    def wall_offset(self, src: int, now: float) -> tuple[int, float, float] | None:
        """Our host's time since 1970 minus that of robot `src`; see `Clocks.wall_offset`."""
        return self._clocks.wall_offset(src, now)

    def clock_state(self, src: int, now: float) -> State:
        """How well a robot's clock is known; our own always is."""
        return self._clocks.state(src, now)

    def clock_estimate(self, src: int, now: float) -> Estimate | None:
        """Our link's clock minus that of robot `src`; None if unknown."""
        return self._clocks.estimate(src, now)

    # Time.

    def expire_queue(self, now: float) -> None:
        """Drop messages that are too old, while there is no radio yet."""
        self._composer.expire(now)
        self._tell_dropped()
        self._receipts.expire(now)

    def handle_timers(self, now: float) -> None:
        """Run all timers up to `now`: expiries, reassembly timeouts, rate samples."""
        scheduler = self._scheduler
        self._composer.expire(now)
        self._intake.suffice(self._demand.periods(now))
        for offer in self._latched.due(now, scheduler.bytes_per_s):
            self._intake.offer_again(offer, now, scheduler.bytes_per_s)
            scheduler.more_to_send()
        self._dispatch(self._reception.expire(now))
        self.sealing.look(now)
        self._answers.expire(now)
        for again in self._routes.look(now):
            self._send_again(again, now)
        self._tell_routes(now)
        self._control_records.look_round(now, scheduler.record_pdu_s)
        self._control_records.tell_topics(now, scheduler.record_pdu_s)
        self._look_at_air(now)
        self._tell_dropped()
        self._receipts.expire(now)
        self._why.sample(now, (each.id for each in self._topics), self._air_use)
        self._reporter.sample(now, scheduler)

    @property
    def has_work(self) -> bool:
        """Whether messages wait to be sent."""
        return bool(self._outbox) or self._scheduler.has_work

    @property
    def holds_parts(self) -> bool:
        """Whether incomplete messages from others wait for more fragments."""
        return self._reception.holds_parts

    @property
    def relays(self) -> bool:
        """Whether this node relays PDUs of others."""
        return self._routes.is_on

    def drain(self) -> None:
        """Prepare to stop: send partial PDUs at once, and send no more beacons."""
        self._control_records.end()
        self._composer.end_flush()

    def shut_down(self) -> None:
        """Drop all messages that were not sent, as tx_shutdown."""
        self._scheduler.clear()
        self._outbox.drop_all("tx_shutdown")
        self._tell_dropped()
        self._receipts.expire(inf)

    # Status and explanations.

    def why(self, topic_id: int, told: Told, now: float) -> list[str]:
        """What happens to a topic's messages and why, in plain sentences."""
        name = self._topics[topic_id].name
        lines = self._why.explain(topic_id, name, told, now, self._air_use())
        report = self._reporter.reserved()
        lines += self._scheduler.moves_words(self._intake.destination(topic_id), now)
        return [*lines, *reserved_words(self.own_id, octet(topic_id), report)]

    def report(self, now: float, names: Names = NO_NAMES) -> LinkReport:
        """Everything the link knows, at `now`."""
        return self._reporter.report(now, names, self._scheduler)

    def notices(self, now: float, of_topics: Mapping[int, str] = NOTHING_NOTED) -> list[str]:
        """What a person should know about this link, in sentences.

        `of_topics`: notices by topic id, which apply once a producer uses the topic.
        """
        return self._reporter.notices(now, of_topics, self._scheduler)

    def audit(self) -> list[str]:
        """Discrepancies in the ledger, as sentences; empty when it adds up."""
        return self._intake.audit() + self._reception.audit()

    # Internal.

    def _air_use(self) -> AirUse:
        repeats = self._answers.report()
        return AirUse(self._scheduler.report(), self._reception.heard_s, repeats)

    def _knows(self, src: int, now: float) -> bool:
        """Whether a robot is one of the team: the configuration names it, or it hears us, too."""
        return src in self._team or self._clocks.has_contact(src, now)

    def _dispatch(self, events: list[Event]) -> list[Delivered]:
        """Handle the inbox's events in order; returns the messages to hand over."""
        delivered = []
        for event in events:
            match event:
                case Delivered():
                    delivered.append(event)
                case PduHeard():
                    self._scheduler.pdu_heard(event)
                case RecordHeard():
                    self._record_heard(event)
                case PduPlaced():
                    self._asking.placed(event)
                    if self._routes.tells_links:
                        self._note_link(event)
                    self._answers.heard(event.read.pdu.src, event.number % PDU_NUMBERS)
                case Newcomer():
                    self._asking.forget(event.src)
                    self._answers.restarted(event.src)
                    self._routes.newcomer(event.src, event.at)
                    self._team_air.newcomer(event.src, event.at)
                    # The new robot lacks the messages latched before.
                    self._latched.newcomer(event.src, event.at)
                    self._control_records.newcomer(event.at)
                case Ended(src, topic_id, entry_id, reason, age_s, at):
                    receipt = make_receipt(src, topic_id, entry_id, reason, age_s)
                    self._control_records.receipt(receipt, at)
                case PduToRelay() if event.is_spare:
                    self._routes.keep(event)
                case PduToRelay():
                    self._forward(event)
        return delivered

    def _record_heard(self, event: RecordHeard) -> None:
        src, record, at = event
        if isinstance(record, Clock):
            # If we hear ourselves, our own CLOCK is no news.
            if src != self.own_id:
                self._clocks.hear(src, record, at)
        elif isinstance(record, Receipt):
            self._receipts.hear(src, record, at)
        elif isinstance(record, Waits):
            self._reception.take_waits(src, record)
        elif isinstance(record, Wanted):
            self._demand.hear(src, record, at)
        elif isinstance(record, RatesAsked):
            self._demand.hear_rates(src, record, at)
        elif isinstance(record, Repeat):
            if src != self.own_id and record.node == src and can_be_true(record):
                self._answers.others_repeat(record, self._scheduler.record_pdu_s, at)
        elif isinstance(record, Need):
            self._asking.others_need(record, at)
            n_others = len(self._reception.neighbors.present(at))
            self._answers.needed(src, record, at, n_others)
            self._scheduler.more_to_send()
        elif isinstance(record, Flows | Admit):
            self._team_air.take(src, record, at)
        elif not isinstance(record, Lsa | Route):
            self._scheduler.record_heard(src, record, at)
        if isinstance(record, Need | Lsa | Route):
            for waiting in self._routes.hear(src, record, at):
                self._forward_after_all(waiting)

    def _forward(self, event: PduToRelay) -> None:
        refused = self._intake.forward(
            event.pdu, event.data, event.at, event.until, event.number,
            self._scheduler.bytes_per_s, is_bare=event.is_bare,
        )  # fmt: skip
        if refused and not event.is_ours_too:
            self._reception.relay_refused()
        if not refused:
            self._scheduler.forwarding(event.pdu, event.at)
        self._scheduler.more_to_send()

    def _forward_after_all(self, event: PduToRelay) -> None:
        if not event.is_ours_too:
            self._reception.relayed_after_all()
        self._forward(event)

    def _note_link(self, event: PduPlaced) -> None:
        read, src = event.read, event.read.pdu.src
        neighbor = self._reception.neighbors.get(src)
        snr_db = None if neighbor is None else neighbor.mean_snr_db
        self._routes.placed(
            src, read.pdu.dst, event.number, event.at, snr_db, is_direct=not read.is_relayed,
            has_messages=read.has_messages,
        )  # fmt: skip

    def _send_again(self, again: Again, now: float) -> None:
        """Repeat PDUs that a robot should have answered, as if it had asked for them."""
        for need in needs(again.src, sorted(again.numbers)):
            self._answers.needed(again.hop, need, now, 1, is_asked=False)
            self._scheduler.more_to_send()

    def _tell_routes(self, now: float) -> None:
        if self._routes.has_new_links:
            self._scheduler.know_links(self._routes.take_links())
        if self._routes.has_news:
            self._control_records.tell_routes(now, self._scheduler.record_pdu_s)
            self._scheduler.more_to_send()

    def _look_at_air(self, now: float) -> None:
        """Ask for the air that flows reserve, and decide who gets it, as far as that is due."""
        air, fit = self._team_air, self._fit
        if fit is not None and air.is_due(now):
            heard = self._reception.neighbors.present(now)
            wanted = self._own_flows.wanted(fit, heard)
            air.look(now, wanted, self._known_links(heard), fit.settled.share)
        if air.has_news(now):
            records = air.told(now)
            self._control_records.tell_air(records, now, self._scheduler.record_pdu_s)
            self._scheduler.more_to_send()

    def _known_links(self, heard: Sequence[int]) -> Edges:
        """The links of the team; where nobody tells them, all robots hear each other."""
        if self._routes.is_auto:
            return self._routes.edges
        team = {self.own_id, *heard}
        return {robot: dict.fromkeys(team - {robot}, 1.0) for robot in team}

    def _refused(self, receipt: str, topic_id: int, reason: str, dst: int | None) -> None:
        dst = self._intake.destination(topic_id) if dst is None else dst
        self._receipts.refused(receipt, topic_id, dst, reason)

    def _expect_receipts(self, start: float) -> None:
        present = self._reception.neighbors.present(start)
        for message in self._composer.take_asking():
            self._receipts.expect(message, present, start)

    def _tell_dropped(self) -> None:
        for message, reason in self._outbox.lives.take_dropped_asking():
            self._receipts.dropped(message, reason)
