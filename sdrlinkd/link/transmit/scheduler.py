"""The next burst: when it may leave, how long it may be, and what goes with it."""

from collections import Counter
from functools import partial
from itertools import chain
from math import inf
from random import Random
from typing import NamedTuple

from sdrlinkd.link.access import Access, AccessParams, Free, Settled, Slot, Wish, settle
from sdrlinkd.link.carrier import CarrierTraits, Opportunity
from sdrlinkd.link.qos import Qos
from sdrlinkd.link.receive import Inbox
from sdrlinkd.link.schedule import Allowance, ClassesParams, Forecasts, Limits, Shares
from sdrlinkd.link.transmit.beacons import Beacons
from sdrlinkd.link.transmit.burst import Burst, Outcome
from sdrlinkd.link.transmit.control_records import ControlRecords
from sdrlinkd.link.transmit.rate import RateControl, RateParams
from sdrlinkd.link.transmit.retry import RetryQueue
from sdrlinkd.link.transmit.sender import Sender
from sdrlinkd.link.transmit.tx_delay import TxDelayMeters
from sdrlinkd.wire import Frame, Record, RecordType

NOTICE_S = 5e-4
"""From a producer's clock to our queue, in real time."""


class _Held(NamedTuple):
    """The air is kept free from `since` to `until`; settled while nothing new has come."""

    since: float
    until: float
    is_settled: bool


_NOT_HELD = _Held(inf, -inf, is_settled=False)


class BurstScheduler:
    """Asks access when, limits how long, the sender what; late bursts go again."""

    def __init__(
        self, sender: Sender, inbox: Inbox, beacons: Beacons, control_records: ControlRecords,
        classes: ClassesParams, own_id: int, has_control: bool, rng: Random,
    ) -> None:  # fmt: skip
        self._sender = sender
        self._inbox = inbox
        self._beacons = beacons
        self._control_records = control_records
        self._own_id = own_id
        self._rng = rng
        self._number = 0
        self._retry = RetryQueue(has_control)
        self.airtime_s = 0.0
        self.control_airtime_s = 0.0
        """Of it, PDUs with nothing but records."""
        self.bursts_by_mcs: Counter[int] = Counter()
        self.forecasts = Forecasts()
        self.shares = Shares(classes)
        self._limits = Limits(classes, self.forecasts)
        self._lead_s, self._notice_s = 0.0, NOTICE_S
        self.least_s = 0.0
        """No message can be younger when it arrives."""
        self._held = _NOT_HELD
        self._ready_at: float | None = None
        self.tx_delays = TxDelayMeters()
        self.access: Access = Free()
        self.settled = Settled(self.access, "none", "as there is no radio yet", {"none": 1.0})
        self.rate = RateControl(RateParams(), (0.0,), 0)

    def attach(self, carrier: CarrierTraits, access: AccessParams, rate: RateParams) -> None:
        """Settle access and rate for the radio that is there. Raises ConfigError."""
        self.rate = RateControl(rate, carrier.needed_snr_db, carrier.mcs)
        longest_s = carrier.longest_in_use_s(self.rate.usable)
        self.settled = settle(access, self._own_id, carrier, longest_s, self._rng)
        self.access = self.settled.access
        self._lead_s = carrier.lead_s
        lengths_s = [
            length_s for mcs, length_s in enumerate(carrier.pdu_burst_s) if mcs in self.rate.usable
        ]
        self.least_s = carrier.lead_s + min(lengths_s, default=0.0)
        # A burst on its own makes a half-duplex radio deaf for much longer than it lasts.
        self._control_records.pdu_s = max(lengths_s, default=0.0) + 2 * carrier.turnaround_s
        self._notice_s = carrier.ahead_s if carrier.is_lockstep else NOTICE_S

    def more_to_send(self) -> None:
        """Something has come; whether to wait is to be decided anew."""
        self._held = self._held._replace(is_settled=False)

    def next_burst(self, opportunity: Opportunity) -> Burst | None:
        """The burst that should leave next, decided now; None: nothing to send, or not yet."""
        earliest, airtime_s, _, sensed, _ = opportunity
        if self._retry:
            return self._again(opportunity)
        head = self._sender.outbox.head()
        if self._ready_at is None:
            self._ready_at = earliest - self._lead_s
        if head is not None:
            qos, destinations = head
            mcs = self.rate.mcs(destinations, qos, earliest)
        elif self._must_tell(earliest):
            qos, mcs = Qos.DEFAULT, self.rate.lowest
        else:
            return None
        slot = self.access.slot(Wish(earliest, qos, airtime_s(mcs, 1), sensed))
        if slot is None:
            return None
        allowance = self._allowance(slot, mcs, opportunity)
        # A schedule's phase holds for the planned start only.
        is_timed = self.access.frame(slot.start) is not None and (
            slot.start >= self._beacons.due_at
            or self._sender.packetizer.piggyback.holds(RecordType.FRAME)
        )
        burst = self.compose(slot.start, allowance)
        if burst is None:
            if head is not None and allowance.until < inf:
                since = min(self._held.since, slot.start)
                self._held = _Held(since, allowance.until, is_settled=True)
            return None
        self._kept_free(slot.start)
        if not any(burst.carried) and airtime_s(self.rate.lowest, 1) <= slot.end - slot.start:
            # Beacons are for everybody.
            mcs = self.rate.lowest
        length_s = airtime_s(mcs, len(burst.pdus))
        if burst.n_records:
            self.control_airtime_s += length_s * burst.n_records / len(burst.pdus)
            self._control_records.told_alone(slot.start)
        self.shares.spend(length_s, burst.classes, self._sender.outbox.waiting_classes())
        self.access.sent(slot.start + length_s, self._relayed_src(burst))
        self._number += 1
        return burst._replace(
            mcs=mcs,
            qos=qos,
            start=slot.start,
            latest=slot.start if is_timed else slot.latest(length_s),
            airtime_s=length_s,
            number=self._number,
            first_start=slot.start,
            ready_at=self._taken_ready_at(),
        )

    def compose(self, start: float, allowance: Allowance) -> Burst | None:
        """The burst that should leave at `start`, decided now; None when there is nothing.

        A beacon that is due rides in spare room; when traffic leaves none for a whole period, or
        there is no traffic, it gets a PDU of its own.
        """
        sender, piggyback = self._sender, self._sender.packetizer.piggyback
        overdue, may_tell = False, allowance.most[Qos.DEFAULT] > 0
        if start >= self._beacons.due_at:
            overdue = piggyback.is_due(start)
            records = self._beacon_records(start)
            piggyback.offer(records, self._alone_at(start, records))
        elif piggyback.holds(RecordType.FRAME) and (frame := self.access.frame(start)):
            piggyback.renew(frame)
            # A schedule does not wait for spare room.
            overdue = True
        overdue = self._control_records.tell(start) or overdue
        if overdue and may_tell:
            # Clocks cannot wait for the end of what is relayed, and no burst holds both.
            urgent = sender.compose(start, allowance.above(Qos.DEFAULT), self._own_id)
            burst = self._records_behind(urgent, start)
        else:
            burst = sender.compose(start, allowance)
        if burst is None and may_tell and piggyback.is_due(start):
            burst = sender.compose_records(start)
        return self._control_records.took(burst)

    def _records_behind(self, urgent: Burst | None, start: float) -> Burst | None:
        """Records in a PDU of their own, behind what is more urgent than they are."""
        records = self._sender.compose_records(start)
        if urgent is None or records is None:
            return urgent or records
        return urgent._replace(
            pdus=urgent.pdus + records.pdus,
            carried=urgent.carried + records.carried,
            classes=urgent.classes + records.classes,
            n_records=records.n_records,
        )

    def confirm(self, burst: Burst, outcome: Outcome, now: float) -> None:
        """What the radio says became of a burst."""
        if outcome is not Outcome.SENT:
            self.access.not_sent(burst.start)
        if outcome is Outcome.LATE and self._retry.give_back(burst):
            self._sender.packetizer.entry_ids.not_left(chain.from_iterable(burst.carried))
            return
        if outcome is Outcome.SENT:
            self._control_records.left(burst)
            self.tx_delays.left(burst)
            self.airtime_s += burst.airtime_s
            self.bursts_by_mcs[burst.mcs] += 1
        self._sender.confirm(burst, outcome, now)

    @property
    def has_work(self) -> bool:
        """Whether messages wait to be sent."""
        return bool(self._sender.outbox) or bool(self._retry)

    def next_wakeup(self, now: float) -> float:
        """When there may next be something to send; not after `now`: at once."""
        if self._retry:
            return now
        wakes_at = self._sender.packetizer.next_wakeup(now)
        if wakes_at <= now and self._held.is_settled:
            wakes_at = self._held.until
        return min(self._beacons.due_at, self._control_records.next_alone_at, wakes_at)

    def drain(self) -> None:
        """Nothing more will come: partial PDUs go at once, beacons end."""
        self._beacons.end()
        self._control_records.end()
        self._sender.packetizer.flush.end()

    def clear(self) -> None:
        """Nothing goes again."""
        self._retry.clear()

    @property
    def bursts_late(self) -> int:
        """Bursts that came too late for their slot and were sent again."""
        return self._retry.count

    def _again(self, opportunity: Opportunity) -> Burst | None:
        """A burst that came too late for its slot, in another one."""
        again = self._retry.head
        airtime_s = opportunity.airtime_s(again.mcs, len(again.pdus))
        slot = self.access.slot(
            Wish(opportunity.earliest, again.qos, airtime_s, opportunity.sensed)
        )
        if slot is None or slot.start + airtime_s > slot.end:
            return None
        burst = self._retry.take(slot.start)
        self.access.sent(slot.start + airtime_s, self._relayed_src(burst))
        self._sender.packetizer.entry_ids.left(chain.from_iterable(burst.carried), slot.start)
        is_timed = again.latest <= again.start
        return burst._replace(latest=slot.start if is_timed else slot.latest(airtime_s))

    def _allowance(self, slot: Slot, mcs: int, opportunity: Opportunity) -> Allowance:
        """For a burst in `slot`."""
        airtime_s, longest_s = opportunity.airtime_s, slot.end - slot.start
        asked = self._sender.outbox.waiting_classes()
        if self._must_tell(slot.start):
            # Records are of the default class.
            asked.add(Qos.DEFAULT)
        one_s, two_s = airtime_s(mcs, 1), airtime_s(mcs, 2)
        if two_s > one_s:
            self._sender.outbox.bytes_per_s = self._sender.packetizer.k_single / (two_s - one_s)
        allowance = self._limits.allow(
            slot.start,
            min(longest_s, max(one_s, opportunity.made_by(slot.start))),
            partial(airtime_s, mcs),
            partial(opportunity.most_pdus, mcs),
            self._lead_s - self.access.pause_s,
            self._notice_s,
            self.access.others_follow,
            asked,
        )
        if slot.least < Qos.BULK:
            allowance = allowance.least(slot.least)
        owed = self.shares.owed(two_s - one_s)
        if not owed or one_s > longest_s:
            return allowance
        return allowance._replace(owed=tuple(owed))

    def _alone_at(self, start: float, records: list[Record]) -> float:
        """From when on a beacon deserves a PDU of its own."""
        needs_it = self.rate.adapts or any(isinstance(each, Frame) for each in records)
        return start if needs_it else self._control_records.alone_at(start)

    def _must_tell(self, start: float) -> bool:
        """Whether records deserve a PDU of their own."""
        return start >= min(self._beacons.due_at, self._control_records.next_alone_at)

    def _taken_ready_at(self) -> float:
        """Since when the radio could have taken the burst that it now takes."""
        ready_at, self._ready_at = self._ready_at, None
        return 0.0 if ready_at is None else ready_at

    def _kept_free(self, start: float) -> None:
        """Settle what was not sent so that something more urgent could be."""
        held, self._held = self._held, _NOT_HELD
        passed_s = min(start, held.until) - held.since
        if passed_s > 0:
            self._limits.kept_free(passed_s)
            self.shares.idle(passed_s, self._sender.outbox.waiting_classes())

    def _beacon_records(self, start: float) -> list[Record]:
        records = self._beacons.take(start, self._inbox.neighbors.values(), self.rate)
        records += self.tx_delays.records()
        frame = self.access.frame(start)
        return records if frame is None else [*records, frame]

    def _relayed_src(self, burst: Burst) -> int | None:
        """Whose PDUs a burst forwards, if any."""
        src = burst.pdus[0][1]
        return None if src == self._own_id else src
