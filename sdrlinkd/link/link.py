"""The link: one node's whole traffic, as a calculator over bytes and `now`."""

from collections import Counter
from collections.abc import Hashable, Mapping
from functools import partial
from itertools import chain
from random import Random
from typing import NamedTuple

from sdrlinkd.link.access import Access, AccessParams, Free, Slot, Wish, make_access
from sdrlinkd.link.beacons import Beacons
from sdrlinkd.link.carrier import CarrierTraits, Opportunity
from sdrlinkd.link.inbox import Delivered, Inbox
from sdrlinkd.link.meters import RateMeter, RecentAges
from sdrlinkd.link.params import LinkParams, QueueParams, ReassemblyParams
from sdrlinkd.link.qos import AS_CONFIGURED, CLASSES, Overrides, Qos, TopicPolicy
from sdrlinkd.link.rate import RateControl, RateParams
from sdrlinkd.link.relay import Relay, RelayParams
from sdrlinkd.link.returned import Returned
from sdrlinkd.link.schedule import Allowance, ClassesParams, Forecasts, Limits, Shares
from sdrlinkd.link.sender import Burst, Outcome, Sender
from sdrlinkd.reports import RATE_WINDOW_S
from sdrlinkd.wire import CONTROL_TOPIC_ID, Frame, LinkReport, Pdu, Record, Registry, Stamp

INFINITE = float("inf")
NOTICE_S = 5e-4
"""From a producer's clock to our queue, in real time."""
NO_RELAY = RelayParams()
DEFAULT_CLASSES = ClassesParams()


class _Held(NamedTuple):
    """The air is kept free from `since` to `until`; settled while nothing new has come."""

    since: float
    until: float
    is_settled: bool


_NOT_HELD = _Held(INFINITE, -INFINITE, is_settled=False)


class Link:
    """Joins sender and inbox, access and rate. Never waits, never reads a clock.

    `now`, `start` and `at` are seconds on one clock of the caller's choice; `rng` is the only
    chance. `hears_self` is the paper's loopback experiment.
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
        hears_self: bool = False,
    ) -> None:
        self.params = params
        self.registry = registry
        self.own_id = own_id
        self.digest = registry.digest()
        self._rng = rng
        self.sender = Sender(params, queue, registry, own_id, rng, reassembly.timeout_s)
        self.inbox = Inbox(params, reassembly, registry, own_id, hears_self, self)
        self.rates = RateMeter(RATE_WINDOW_S)
        self.ages: dict[tuple[int, int], RecentAges] = {}
        period_s = params.beacon_s if registry.has_control else 0.0
        self._beacons = Beacons(period_s, params.pdu_size, self.digest, rng, own_id)
        self._number = 0
        self._returned = Returned(registry.has_control)
        self.airtime_s = 0.0
        self.bursts_by_mcs: Counter[int] = Counter()
        self.relay = Relay(relay, own_id)
        self.forecasts = Forecasts()
        self.shares = Shares(classes)
        self._limits = Limits(classes, self.forecasts)
        self._lead_s, self._notice_s = 0.0, NOTICE_S
        self._held = _NOT_HELD
        self.access: Access = Free()
        self.rate = RateControl(RateParams(), (0.0,), 0)

    def attach(self, carrier: CarrierTraits, access: AccessParams, rate: RateParams) -> None:
        """Settle access and rate for the radio that is there. Raises ConfigError."""
        self.rate = RateControl(rate, carrier.needed_snr_db, carrier.mcs)
        longest_s = max(carrier.longest_burst_s[mcs] for mcs in self.rate.usable)
        self.access = make_access(access, self.own_id, carrier, longest_s, self._rng)
        self._lead_s = carrier.lead_s
        self._notice_s = carrier.ahead_s if carrier.is_lockstep else NOTICE_S

    def set_policies(self, policies: Mapping[int, TopicPolicy]) -> None:
        """Apply per-topic policies by topic id; the others get the defaults."""
        self.sender.set_policies(policies)

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
            self.forecasts.note((self.own_id, topic_id), qos, now)
            self._held = self._held._replace(is_settled=False)
        return refused

    def next_burst(self, opportunity: Opportunity) -> Burst | None:
        """The burst that should leave next, decided now; None: nothing to send, or not yet."""
        earliest, airtime_s, _, sensed = opportunity
        if self._returned:
            return self._again(opportunity)
        head = self.sender.outbox.head()
        if head is not None:
            qos, destinations = head
            mcs = self.rate.mcs(destinations, qos, earliest)
        elif earliest >= self._beacons.due_at or self.sender.packetizer.offered:
            qos, mcs = Qos.DEFAULT, self.rate.lowest
        else:
            return None
        slot = self.access.slot(Wish(earliest, qos, airtime_s(mcs, 1), sensed))
        if slot is None:
            return None
        allowance = self._allowance(slot, mcs, opportunity)
        # A schedule's phase holds for the planned start only.
        is_timed = self.access.frame(slot.start) is not None and (
            slot.start >= self._beacons.due_at or self.sender.packetizer.offered
        )
        burst = self.compose(slot.start, allowance)
        if burst is None:
            if head is not None and allowance.until < INFINITE:
                since = min(self._held.since, slot.start)
                self._held = _Held(since, allowance.until, is_settled=True)
            return None
        self._kept_free(slot.start)
        if not any(burst.carried) and airtime_s(self.rate.lowest, 1) <= slot.end - slot.start:
            # Beacons are for everybody.
            mcs = self.rate.lowest
        length_s = airtime_s(mcs, len(burst.pdus))
        self.shares.spend(length_s, burst.classes, self.sender.outbox.waiting_classes())
        self.access.sent(slot.start + length_s, _origin(burst, self.own_id))
        self._number += 1
        return burst._replace(
            mcs=mcs,
            qos=qos,
            start=slot.start,
            latest=slot.start if is_timed else slot.latest(length_s),
            airtime_s=length_s,
            number=self._number,
            first_start=slot.start,
        )

    def _again(self, opportunity: Opportunity) -> Burst | None:
        """A burst that came too late for its slot, in another one."""
        again = self._returned.head
        airtime_s = opportunity.airtime_s(again.mcs, len(again.pdus))
        slot = self.access.slot(
            Wish(opportunity.earliest, again.qos, airtime_s, opportunity.sensed)
        )
        if slot is None or slot.start + airtime_s > slot.end:
            return None
        burst = self._returned.take(slot.start)
        self.access.sent(slot.start + airtime_s, _origin(burst, self.own_id))
        self.sender.packetizer.left(chain.from_iterable(burst.carried), slot.start)
        is_timed = again.latest <= again.start
        return burst._replace(latest=slot.start if is_timed else slot.latest(airtime_s))

    def compose(self, start: float, allowance: Allowance) -> Burst | None:
        """The burst that should leave at `start`, decided now; None when there is nothing.

        A beacon that is due rides in spare room; when traffic leaves none for a whole period, or
        there is no traffic, it gets a PDU of its own.
        """
        packetizer = self.sender.packetizer
        overdue, may_tell = False, allowance.most[Qos.DEFAULT] > 0
        if start >= self._beacons.due_at:
            overdue = packetizer.offered
            packetizer.offer(self._beacon_records(start))
        elif packetizer.offered and (frame := self.access.frame(start)):
            packetizer.renew(frame)
            # Clocks do not wait for spare room.
            overdue = True
        burst = (
            self.sender.compose_records()
            if overdue and may_tell
            else self.sender.compose(start, allowance)
        )
        if burst is None and packetizer.offered and may_tell:
            burst = self.sender.compose_records()
        return burst

    def confirm(self, burst: Burst, outcome: Outcome, now: float) -> None:
        """What the radio says became of a burst."""
        if outcome is not Outcome.SENT:
            self.access.not_sent(burst.start)
        if outcome is Outcome.LATE and self._returned.give_back(burst):
            self.sender.packetizer.not_left(chain.from_iterable(burst.carried))
            return
        if outcome is Outcome.SENT:
            self.airtime_s += burst.airtime_s
            self.bursts_by_mcs[burst.mcs] += 1
        self.sender.confirm(burst, outcome, now)

    def hear(self, data: bytes, at: float, snr_db: float | None = None) -> list[Delivered]:
        """Take a PDU whose burst's preamble arrived at `at`; the messages it completed."""
        return self.inbox.hear(data, at, snr_db)

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
        self.inbox.expire(now)
        if self.rates.is_due(now):
            self.rates.sample(self.rate_counters(), now)

    @property
    def has_work(self) -> bool:
        """Whether messages wait to be sent."""
        return bool(self.sender.outbox) or bool(self._returned)

    def next_wakeup(self, now: float) -> float:
        """When there may next be something to send; not after `now`: at once."""
        if self._returned:
            return now
        wakes_at = self.sender.packetizer.next_wakeup(now)
        if wakes_at <= now and self._held.is_settled:
            wakes_at = self._held.until
        return min(self._beacons.due_at, wakes_at)

    def drain(self) -> None:
        """Nothing more will come: partial PDUs go at once, beacons end."""
        self._beacons.end()
        self.sender.packetizer.flush()

    def shut_down(self) -> None:
        """Drop what could not be sent any more, by name."""
        self._returned.clear()
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

    @property
    def bursts_late(self) -> int:
        """Bursts that came too late for their slot and were sent again."""
        return self._returned.count

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
                self.forecasts.note((src, entry.topic_id), qos, origin)

    def sends_on(self, pdu: Pdu, data: bytes, at: float) -> bool:
        """Forward it, if that is our part."""
        if not self.relay.wants(pdu):
            return False
        return self.sender.forward(pdu, data, at, at + self.relay.lifespan_s) is None

    def record_from(self, src: int, record: Record, at: float) -> None:
        """A control record that is not about messages."""
        if isinstance(record, LinkReport):
            if record.node == self.own_id:
                self.rate.take(src, record, at)
            else:
                self.access.told_of(record.node, at)
        elif isinstance(record, Frame):
            self.access.take_frame(src, record, at)

    def _allowance(self, slot: Slot, mcs: int, opportunity: Opportunity) -> Allowance:
        """For a burst in `slot`."""
        _, airtime_s, most_pdus, _ = opportunity
        longest_s = slot.end - slot.start
        one_s, two_s = airtime_s(mcs, 1), airtime_s(mcs, 2)
        allowance = self._limits.allow(
            slot.start,
            longest_s,
            partial(airtime_s, mcs),
            partial(most_pdus, mcs),
            self._lead_s - self.access.pause_s,
            self._notice_s,
            self.access.others_follow,
        ).least(slot.least)
        owed = self.shares.owed(two_s - one_s) if one_s <= longest_s else None
        if owed not in self.sender.outbox.waiting_classes():
            owed = None
        return allowance._replace(owed=owed)

    def _kept_free(self, start: float) -> None:
        """Settle what was not sent so that something more urgent could be."""
        held, self._held = self._held, _NOT_HELD
        passed_s = min(start, held.until) - held.since
        if passed_s > 0:
            self._limits.kept_free(passed_s)
            self.shares.idle(passed_s, self.sender.outbox.waiting_classes())

    def _beacon_records(self, start: float) -> list[Record]:
        records = self._beacons.take(start, self.inbox.neighbors.values(), self.rate)
        frame = self.access.frame(start)
        return records if frame is None else [*records, frame]


def _origin(burst: Burst, own_id: int) -> int | None:
    """Whose PDUs they are, if others'."""
    src = burst.pdus[0][1]
    return None if src == own_id else src
