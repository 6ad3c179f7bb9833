"""The next burst: when it may leave, how long it may be, how fast, and what goes again.

One burst is decided in five steps. (1) What goes next, by class: it gives the MCS. (2) The access
policy says when such a burst may leave, and when it must be over. (3) Forecasts and caps say how
many PDUs of each class it may hold: a bulk burst that is on the air when a command comes delays it
by all of its length, so bursts end before the next urgent message is due, and are short while one
may come that nobody can foresee. (4) Records that are due are made, and the composer fills the
PDUs. (5) The burst's airtime is put to the classes' accounts. A burst that came too late for its
slot goes again, unchanged but for the ages inside, before anything new is composed.
"""

from collections import Counter
from functools import partial
from itertools import chain
from math import inf
from typing import NamedTuple

from sdrlinkd.link.access import Slot, Wish
from sdrlinkd.link.packing import BuiltPdu, Composer
from sdrlinkd.link.qos import Qos
from sdrlinkd.link.queue import Outbox
from sdrlinkd.link.receive import PduHeard
from sdrlinkd.link.schedule import Allowance, ClassesParams, Forecasts, Limits, Shares
from sdrlinkd.link.traits import Opportunity
from sdrlinkd.link.transmit.burst import Burst, Outcome
from sdrlinkd.link.transmit.control_records import ControlRecords
from sdrlinkd.link.transmit.fit import Fit
from sdrlinkd.link.transmit.overheard import Overheard
from sdrlinkd.link.transmit.rate import HeardThere
from sdrlinkd.link.transmit.report import TransmitReport
from sdrlinkd.link.transmit.retry import RetryQueue
from sdrlinkd.link.transmit.tx_delay import TxDelayMeters
from sdrlinkd.wire import Record


class _Held(NamedTuple):
    """The air is kept free from `since` to `until`; settled while nothing new has come."""

    since: float
    until: float
    is_settled: bool


_NOT_HELD = _Held(inf, -inf, is_settled=False)


class BurstScheduler:
    """Asks access when, limits how long, the composer what; late bursts go again."""

    def __init__(
        self, fit: Fit, outbox: Outbox, composer: Composer, control_records: ControlRecords,
        tx_delays: TxDelayMeters, forecasts: Forecasts, classes: ClassesParams, own_id: int,
        has_control: bool,
    ) -> None:  # fmt: skip
        self._outbox = outbox
        self._lives = outbox.lives
        self._composer = composer
        self._entry_ids = composer.entry_ids
        self._control_records = control_records
        self._tx_delays = tx_delays
        self._forecasts = forecasts
        self._own_id = own_id
        self._has_control = has_control
        self._number = 0
        self._retry = RetryQueue(has_control)
        self._used_s = dict.fromkeys(Qos, 0.0)
        """Airtime composed so far by the class of each PDU, bursts that failed included."""
        self.airtime_s = 0.0
        """Airtime of bursts that left."""
        self._control_airtime_s = 0.0
        """Airtime of PDUs with nothing but records."""
        self._bursts_by_mcs: Counter[int] = Counter()
        self._bursts_sent = self._bursts_failed = 0
        self._pdus_sent = self._pdus_failed = 0
        self.bytes_per_s = inf
        """What the air carries at the moment; infinity before the first burst."""
        self._shares = Shares(classes)
        self._limits = Limits(classes, forecasts)
        self._held = _NOT_HELD
        self._ready_at: float | None = None
        self.refit(fit)

    def refit(self, fit: Fit) -> None:
        """Go on with another radio: what waits and what was counted stays."""
        self._fit = fit
        self._access, self._rate = fit.settled.access, fit.rate
        self._overheard = Overheard(fit, self._forecasts, self._own_id, self._has_control)

    def more_to_send(self) -> None:
        """Decide anew whether to wait: something has come."""
        if self._held.is_settled:
            self._held = self._held._replace(is_settled=False)

    def next_burst(self, opportunity: Opportunity) -> Burst | None:
        """The burst that should leave next, decided now; None: nothing to send, or not yet."""
        if self._retry.waiting:
            return self._again(opportunity)
        earliest, airtime_s, _, sensed, _ = opportunity
        rate, access, records = self._rate, self._access, self._control_records
        head, records_due_at = self._outbox.next_class(), records.due_at
        if self._ready_at is None:
            self._ready_at = earliest - self._fit.lead_s
        if head is None and earliest < records_due_at:
            return None
        qos, mcs = Qos.DEFAULT if head is None else head, rate.lowest
        if rate.adapts and head is not None:
            mcs = rate.mcs(self._outbox.destinations(), qos, earliest)
        slot = access.slot(Wish(earliest, qos, airtime_s(mcs, 1), sensed))
        if slot is None:
            return None
        start = slot.start
        allowance = self._allowance(slot, mcs, opportunity, start >= records_due_at)
        frame = access.frame(start) if access.keeps_schedule else None
        # A schedule's phase holds for the planned start only.
        is_timed = frame is not None and records.tells_schedule(start)
        cannot_wait = records.collect(start, frame, rate)
        built, n_records = self._fill(start, allowance, cannot_wait)
        if not built:
            if head is not None and allowance.until < inf:
                since = min(self._held.since, start)
                self._held = _Held(since, allowance.until, is_settled=True)
            return None
        clock = records.took_clock() if records.clock_waits else None
        if self._held is not _NOT_HELD:
            self._kept_free(start)
        carried = [pdu.carried for pdu in built]
        if not any(carried) and airtime_s(rate.lowest, 1) <= slot.end - start:
            # Beacons are for everybody.
            mcs = rate.lowest
        length_s = airtime_s(mcs, len(built))
        if n_records:
            self._control_airtime_s += length_s * n_records / len(built)
            records.told_alone(start)
        classes = [pdu.qos for pdu in built]
        self._spend(length_s, classes)
        pdus = [pdu.data for pdu in built]
        access.sent(start + length_s, self._relayed_src(pdus))
        ready_at, self._ready_at = self._ready_at, None
        self._number += 1
        return Burst(
            pdus,
            carried,
            classes,
            mcs,
            qos,
            start,
            start if is_timed else max(start, slot.late_end - length_s),
            length_s,
            self._number,
            first_start=start,
            n_records=n_records,
            ready_at=ready_at,
            clock=clock,
        )

    def confirm(self, burst: Burst, outcome: Outcome, now: float) -> None:
        """Settle a burst by what the radio says became of it."""
        is_sent = outcome is Outcome.SENT
        if not is_sent:
            self._access.not_sent(burst.start)
        if outcome is Outcome.LATE and self._retry.give_back(burst):
            self._entry_ids.not_left(chain.from_iterable(burst.carried))
            return
        if is_sent:
            if burst.clock is not None:
                self._control_records.left(burst.clock, burst.start)
            self._tx_delays.left(burst)
            self.airtime_s += burst.airtime_s
            self._bursts_by_mcs[burst.mcs] += 1
            self._bursts_sent += 1
            self._pdus_sent += len(burst.pdus)
            self._lives.left(burst.carried)
            return
        self._bursts_failed += 1
        self._pdus_failed += len(burst.pdus)
        for message in self._lives.failed(burst.carried):
            self._composer.abandon(message.lane, now)

    @property
    def has_work(self) -> bool:
        """Whether bursts wait for another slot."""
        return bool(self._retry.waiting)

    def next_wakeup(self, now: float) -> float:
        """When there may next be something to send; not after `now`: at once."""
        if self._retry.waiting:
            return now
        wakes_at = self._composer.next_wakeup(now)
        if wakes_at <= now and self._held.is_settled:
            wakes_at = self._held.until
        return min(self._control_records.due_at, wakes_at)

    def clear(self) -> None:
        """Forget the bursts that go again."""
        self._retry.clear()

    @property
    def least_s(self) -> float:
        """No message of ours can be younger when it arrives."""
        return self._fit.least_s

    @property
    def record_pdu_s(self) -> float:
        """The airtime of a PDU with nothing but records."""
        return self._fit.record_pdu_s

    def pdu_heard(self, event: PduHeard) -> None:
        """Take note of a good PDU that somebody else has sent."""
        self._overheard.pdu(event)

    def record_heard(self, src: int, record: Record, at: float) -> None:
        """Take note of a record that another robot has sent to all."""
        self._overheard.record(src, record, at)

    def access_notices(self, now: float) -> list[str]:
        """What a person should know of the access policy."""
        return self._access.notices(now)

    def heard_by(self, src: int) -> HeardThere:
        """How robot `src` hears us, and what we send to it with."""
        return self._rate.heard_there(src)

    def report(self) -> TransmitReport:
        """What was sent so far, and how."""
        rate = self._rate
        return TransmitReport(
            self._fit.settled,
            self.bytes_per_s,
            dict(self._used_s),
            self.airtime_s,
            self._control_airtime_s,
            dict(self._bursts_by_mcs),
            self._bursts_sent,
            self._bursts_failed,
            self._retry.count,
            self._pdus_sent,
            self._pdus_failed,
            rate.lowest if rate.adapts else None,
            tuple(rate.changes),
        )

    def _again(self, opportunity: Opportunity) -> Burst | None:
        """A burst that came too late for its slot, in another one."""
        again = self._retry.waiting[0]
        airtime_s = opportunity.airtime_s(again.mcs, len(again.pdus))
        slot = self._access.slot(
            Wish(opportunity.earliest, again.qos, airtime_s, opportunity.sensed)
        )
        if slot is None or slot.start + airtime_s > slot.end:
            return None
        burst = self._retry.take(slot.start)
        self._access.sent(slot.start + airtime_s, self._relayed_src(burst.pdus))
        self._entry_ids.left(chain.from_iterable(burst.carried), slot.start)
        is_timed = again.latest <= again.start
        latest = slot.start if is_timed else max(slot.start, slot.late_end - airtime_s)
        return burst._replace(latest=latest)

    def _fill(
        self, start: float, allowance: Allowance, cannot_wait: bool
    ) -> tuple[list[BuiltPdu], int]:
        """(PDUs, how many of them hold nothing but records) of a burst at `start`.

        A record that is due rides in spare room; where traffic leaves none for too long, or there
        is no traffic, it gets a PDU of its own.
        """
        composer, records = self._composer, self._control_records
        may_tell = allowance.most[Qos.DEFAULT] > 0
        if cannot_wait and may_tell:
            # Behind what is more urgent than records are. Clocks cannot wait for the end of what
            # is relayed, and no burst holds both.
            built = composer.fill(start, allowance.above(Qos.DEFAULT), self._own_id)
        else:
            built = composer.fill(start, allowance)
            if built or not may_tell or not records.is_due(start):
                return built, 0
        alone = composer.fill_with_records(start)
        return built + alone, len(alone)

    def _allowance(
        self, slot: Slot, mcs: int, opportunity: Opportunity, must_tell: bool
    ) -> Allowance:
        """How many PDUs of each class a burst in `slot` may hold."""
        airtime_s, made_by, longest_s = (
            opportunity.airtime_s, opportunity.made_by, slot.end - slot.start
        )  # fmt: skip
        access, fit = self._access, self._fit
        asked = self._outbox.waiting_classes()
        if must_tell:
            # Records are of the default class.
            asked.add(Qos.DEFAULT)
        one_s, two_s = airtime_s(mcs, 1), airtime_s(mcs, 2)
        if two_s > one_s:
            self.bytes_per_s = self._composer.k_single / (two_s - one_s)
        allowance = self._limits.allow(
            slot.start,
            longest_s if made_by is None else min(longest_s, max(one_s, made_by(slot.start))),
            partial(airtime_s, mcs),
            partial(opportunity.most_pdus, mcs),
            fit.lead_s - access.pause_s,
            fit.notice_s,
            access.others_follow,
            asked,
        )
        if slot.least < Qos.BULK:
            allowance = allowance.least(slot.least)
        if not self._shares.is_owed or one_s > longest_s:
            return allowance
        return allowance._replace(owed=tuple(self._shares.owed(two_s - one_s)))

    def _spend(self, length_s: float, classes: list[Qos]) -> None:
        """Put a burst to the accounts of its PDUs' classes."""
        each_s = length_s / len(classes)
        for qos in classes:
            self._used_s[qos] += each_s
        if self._outbox.levels or self._shares.is_owed:
            self._shares.spend(length_s, classes, self._outbox.waiting_classes())

    def _kept_free(self, start: float) -> None:
        """Settle what was not sent so that something more urgent could be."""
        held, self._held = self._held, _NOT_HELD
        passed_s = min(start, held.until) - held.since
        if passed_s > 0:
            self._limits.kept_free(passed_s)
            self._shares.idle(passed_s, self._outbox.waiting_classes())

    def _relayed_src(self, pdus: list[bytes]) -> int | None:
        """The robot whose PDUs a burst forwards, if any."""
        src = pdus[0][1]
        return None if src == self._own_id else src
