"""The burst scheduler: when the next burst leaves, its length, MCS and content, and retries.

A burst is decided in five steps. (1) The class of the next message determines the MCS. (2) The
access policy says when such a burst may leave and when it must be over. (3) Forecasts and caps
limit the number of PDUs of each class: a bulk burst that is on the air when a command comes delays
it by up to the burst's length. So bursts end before the next urgent message is due, and are short
while one may come at an unpredictable time. (4) Records that are due are made, and the composer
fills the PDUs. (5) The burst's airtime is charged to the classes. A burst that missed its slot is
sent again, unchanged except for the ages inside, before a new one is composed.
"""

from collections import Counter
from collections.abc import Sequence
from functools import partial
from itertools import accumulate, chain
from math import inf
from typing import NamedTuple

from sdrlinkd.link.access import Due, Slot, Wish
from sdrlinkd.link.packing import MAX_PDUS, BuiltPdu, Composer, PiggybackRecords
from sdrlinkd.link.paths import Edges
from sdrlinkd.link.qos import Qos
from sdrlinkd.link.queue import Outbox
from sdrlinkd.link.receive import PduHeard
from sdrlinkd.link.repeat import Answers, Wanted
from sdrlinkd.link.schedule import Allowance, ClassesParams, Forecasts, Limits, Shares
from sdrlinkd.link.traits import Opportunity
from sdrlinkd.link.transmit.bids import ROOM, Bid, Bids
from sdrlinkd.link.transmit.burst import Burst, Outcome
from sdrlinkd.link.transmit.control_records import ControlRecords
from sdrlinkd.link.transmit.fit import Fit
from sdrlinkd.link.transmit.motion import Motion, Moves, longest_burst_s
from sdrlinkd.link.transmit.overheard import Knows, Overheard
from sdrlinkd.link.transmit.own_turns import OwnTurns
from sdrlinkd.link.transmit.rate import HeardThere
from sdrlinkd.link.transmit.repetitions import Repetitions
from sdrlinkd.link.transmit.report import TransmitReport
from sdrlinkd.link.transmit.retry import RetryQueue
from sdrlinkd.link.transmit.tx_delay import TxDelayMeters
from sdrlinkd.sealing import InTheClear, Sealing
from sdrlinkd.wire import TICKS_PER_S, Pdu, Record

POSTPONED_S = 1e-5
"""Time in s from which a burst counts as postponed."""
TICK_S = 1 / TICKS_PER_S
"""Time in s after which there are new numbers for sealed PDUs."""


class _Held(NamedTuple):
    """A time for which the channel is kept free, from `since` to `until`.

    `is_settled`: no new message has come since that was decided.
    """

    since: float
    until: float
    is_settled: bool


_NOT_HELD = _Held(inf, -inf, is_settled=False)


class BurstScheduler:
    """Decides the next burst, with the access policy, the limits and the composer; retries late
    bursts.
    """

    def __init__(
        self, fit: Fit, outbox: Outbox, composer: Composer, control_records: ControlRecords,
        tx_delays: TxDelayMeters, forecasts: Forecasts, classes: ClassesParams, own_id: int,
        has_control: bool, sealing: Sealing | InTheClear, answers: Answers, knows: Knows,
        clear_size: int, piggyback: PiggybackRecords,
    ) -> None:  # fmt: skip
        self._piggyback = piggyback
        self._knows = knows
        self._answers = answers
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
        self._sealing = sealing
        self._clear_size = clear_size
        self._numbers_at = -inf
        """Time in s at which there may be numbers for sealed PDUs again."""
        self._retry = RetryQueue(sealing, composer.take_number)
        self._used_s = dict.fromkeys(Qos, 0.0)
        """Airtime composed so far by the class of each PDU, in s; includes bursts that failed."""
        self.airtime_s = 0.0
        """Airtime of all bursts that left, in s."""
        self._control_airtime_s = 0.0
        """Airtime of PDUs that hold only records, in s."""
        self._bursts_by_mcs: Counter[int] = Counter()
        self._bursts_sent = self._bursts_failed = 0
        self._pdus_sent = self._pdus_failed = 0
        self.bytes_per_s = inf
        """Present capacity of the channel in payload bytes per s; infinity while unknown."""
        self._shares = Shares(classes)
        self._limits = Limits(classes, forecasts)
        self._motion = Motion()
        self._held = _NOT_HELD
        self._repetitions = Repetitions(answers, composer, sealing)
        self._has_repeated = False
        """Whether the last burst was a repeat."""
        self._ready_at: float | None = None
        self.refit(fit)

    def refit(self, fit: Fit) -> None:
        """Continue with another radio; waiting bursts and counters stay."""
        self._fit = fit
        self._access, self._rate = fit.settled.access, fit.rate
        self._answers.set_slower(fit.slower)
        self._adopt()
        self._pulse_s = fit.pulse_s
        self._overheard = Overheard(
            fit, self._forecasts, self._motion, self._own_id, self._has_control, self._knows
        )

    def _adopt(self) -> None:
        """Ask for the air as the policy has it now: by request, or by auction."""
        by_request, by_auction = self._access.by_request, self._access.by_auction
        self._adopted = by_request, by_auction
        self._turns = None if by_request is None else OwnTurns(
            by_request, self._fit, self._outbox, self._composer, self._control_records,
            self._piggyback, self._forecasts, self._answers, self._own_id,
        )  # fmt: skip
        self._bids = None if by_auction is None else Bids(
            by_auction, self._outbox, self._composer, self._own_id
        )  # fmt: skip
        self._composer.leave_room(b"" if by_auction is None else ROOM)

    def more_to_send(self) -> None:
        """Revise the decision to keep the channel free, as a message has come."""
        if self._held.is_settled:
            self._held = self._held._replace(is_settled=False)

    def next_burst(self, opportunity: Opportunity) -> Burst | None:
        """The burst that should leave next, decided now; None: nothing to send, or not yet."""
        if self._adopted != (self._access.by_request, self._access.by_auction):
            self._adopt()
        if self._retry.waiting:
            return self._again(opportunity)
        earliest, airtime_s, _, sensed, _ = opportunity
        rate, access, records = self._rate, self._access, self._control_records
        composer = self._composer
        head, records_due_at = self._outbox.next_class(), records.due_at
        if self._ready_at is None:
            self._ready_at = earliest - self._fit.lead_s
        repeated = None
        if self._answers.wanted:
            due = self._answers.due(earliest, composer.next_number)
            if due:
                repeated = due[0].kept.qos
                # Among equals, new messages and repeats take turns.
                if head is None or repeated + self._has_repeated <= head:
                    burst = self._repeat(opportunity, due)
                    if burst is not None:
                        self._has_repeated = True
                        return burst
        turns = self._turns
        tells_at = min(access.tells_at, inf if turns is None else turns.asks_at(earliest))
        if head is None and earliest < min(records_due_at, tells_at):
            return None
        qos, mcs = Qos.DEFAULT if head is None else head, rate.lowest
        if rate.adapts and head is not None:
            mcs = rate.mcs(self._outbox.destinations(), qos, earliest)
        # Those that are repeated after this burst, before others of their class.
        then = None if head is None or self._has_repeated else repeated
        waiting, then_s = None, 0.0
        dues: tuple[Due, ...] = ()
        if turns is not None:
            if then is not None:
                then_s = turns.repeats_s(partial(airtime_s, mcs))
            waiting = turns.waiting(earliest, partial(airtime_s, mcs))
            dues = turns.dues(earliest, partial(airtime_s, mcs))
        elif self._bids is not None:
            waiting = self._bids.waiting()
        slot = access.slot(Wish(earliest, qos, airtime_s(mcs, 1), sensed, waiting, dues, then_s))
        if slot is None:
            return None
        start = slot.start
        if slot.is_pulse:
            return self._pulse(start, qos)
        if self._adopted != (access.by_request, access.by_auction):
            # The team goes on by request from this burst on.
            self._adopt()
            turns = self._turns
        sealing = self._sealing
        if sealing.is_on and not self._may_seal(start, MAX_PDUS):
            return self._in_the_clear(slot, airtime_s(rate.lowest, 1))
        allowance = self._allowance(
            slot, mcs, opportunity, Qos.DEFAULT if start >= records_due_at else None
        )
        if then is not None and any((higher := allowance.more_urgent(then)).most):
            allowance = higher
        frame = access.frame(start) if access.keeps_schedule else None
        # A schedule's phase is valid only for the planned start.
        is_timed = frame is not None and records.tells_schedule(start)
        cannot_wait = records.collect(start, frame, rate)
        first_number, bid = composer.next_number, None
        if turns is not None:
            built, n_records = turns.fill(
                slot, allowance, partial(airtime_s, mcs), waiting, cannot_wait=cannot_wait
            )
        else:
            if self._bids is not None:
                bid = self._bids.after(allowance, partial(airtime_s, mcs))
            built, n_records = self._fill(start, allowance, cannot_wait, bid)
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
            # A burst of only records is for all robots, so use the slowest MCS.
            mcs = rate.lowest
        length_s = airtime_s(mcs, len(built))
        alone_s = length_s * n_records / len(built)
        if n_records:
            self._control_airtime_s += alone_s
            records.told_alone(start)
        if records.questions_wait:
            records.took_questions(start, alone_s)
        classes = [pdu.qos for pdu in built]
        self._spend(length_s, classes)
        pdus = [pdu.data for pdu in built]
        if turns is None:
            numbers = list(range(first_number, first_number + len(built)))
        else:
            # PDUs of others may be between ours, which then follow each other.
            ours = accumulate(pdu.src == self._own_id for pdu in built)
            numbers = [first_number + n - 1 for n in ours]
        inner: list[bytes] = []
        if self._bids is not None and bid is not None:
            self._bids.told(bid, start, built)
        if sealing.is_on:
            pdus, inner = self._sealed(pdus, start)
        access.sent(start + length_s, self._relayed_src(pdus))
        ready_at, self._ready_at = self._ready_at, None
        self._has_repeated = False
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
            planned_start=start,
            n_timed=len(pdus) * self._has_control,
            inner=inner,
            numbers=numbers,
        )

    def confirm(self, burst: Burst, outcome: Outcome, now: float) -> None:
        """Settle a burst by the outcome that the radio reports."""
        is_sent = outcome is Outcome.SENT
        if not is_sent:
            self._access.not_sent(burst.start)
        if burst.is_pulse:
            used_s = burst.airtime_s * is_sent
            self.airtime_s += used_s
            self._control_airtime_s += used_s
            return
        is_late, repeated = outcome is Outcome.LATE, burst.repeated
        if is_late and repeated is None and self._retry.give_back(burst, now):
            self._entry_ids.not_left(chain.from_iterable(burst.carried))
            return
        if is_sent:
            self.airtime_s += burst.airtime_s
            self._bursts_by_mcs[burst.mcs] += 1
            self._bursts_sent += 1
            self._pdus_sent += len(burst.pdus)
            if repeated is not None:
                self._answers.left(repeated, burst.airtime_s)
                return
            if burst.clock is not None:
                self._control_records.left(burst.clock, burst.start)
            self._tx_delays.left(burst)
            self._lives.left(burst.carried)
            planned = burst.start if burst.planned_start is None else burst.planned_start
            self._answers.sent(
                burst.numbers, burst.pdus, burst.inner, burst.carried, burst.classes, burst.mcs,
                planned, is_postponed=burst.start > planned + POSTPONED_S,
            )  # fmt: skip
            return
        self._bursts_failed += 1
        self._pdus_failed += len(burst.pdus)
        if repeated is not None:
            self._answers.not_left(repeated, now)
            return
        reason = "tx_expired" if is_late and burst.is_in_vain(now) else "tx_radio_failed"
        for message in self._lives.failed(burst.carried, reason):
            self._composer.abandon(message.lane, now)

    @property
    def has_work(self) -> bool:
        """Whether bursts wait for another slot."""
        return bool(self._retry.waiting)

    def next_wakeup(self, now: float) -> float:
        """Earliest time at which there may be something to send; if not after `now`: at once."""
        if self._retry.waiting:
            return now
        wakes_at = self._composer.next_wakeup(now)
        if wakes_at <= now and self._held.is_settled:
            wakes_at = self._held.until
        if wakes_at <= now:
            # Nothing else is needed, and this is asked often.
            return max(wakes_at, self._numbers_at)
        wakes_at = min(self._control_records.due_at, wakes_at, self._answers.due_at(now))
        lead_s, tells_at = self._fit.lead_s, self._access.tells_at
        if self._turns is not None:
            tells_at = min(tells_at, self._turns.asks_at(now + lead_s))
        wakes_at = min(wakes_at, tells_at - lead_s)
        return max(wakes_at, self._numbers_at)

    def clear(self) -> None:
        """Drop all bursts that wait for another slot."""
        self._retry.clear()

    @property
    def least_s(self) -> float:
        """Smallest possible age of our messages at their arrival, in s."""
        return self._fit.least_s

    @property
    def round_s(self) -> float:
        """Longest time in s until every robot has had a turn; 0 if there are no turns."""
        return self._access.round_s

    @property
    def record_pdu_s(self) -> float:
        """Airtime lost to a PDU that holds only records, in s, including turnarounds."""
        return self._fit.record_pdu_s

    def pdu_heard(self, event: PduHeard) -> None:
        """Note a valid PDU that another robot has sent."""
        self._overheard.pdu(event)

    def forwarding(self, pdu: Pdu, at: float) -> None:
        """Note a PDU of another robot that we forward, heard at `at`."""
        self._overheard.forwarding(pdu, at)

    def record_heard(self, src: int, record: Record, at: float) -> None:
        """Note a record that another robot has sent to all."""
        self._overheard.record(src, record, at)

    def know_links(self, edges: Edges) -> None:
        """Take the links of the team, as they are now."""
        self._access.know_links(edges)

    def access_notices(self, now: float) -> list[str]:
        """What a person should know about the access policy, in sentences."""
        return self._access.notices(now)

    def heard_by(self, src: int) -> HeardThere:
        """How robot `src` hears us, and the MCS with which we send to it."""
        return self._rate.heard_there(src)

    def moves(self, src: int, now: float) -> Moves:
        """How fast the channel to robot `src` changes, and how that bounds bursts."""
        bound_s = self._motion.longest_s({src}, now)
        is_bound = bound_s < self._fit.most_s
        return Moves(self._motion.doppler_hz(src, now), bound_s if is_bound else None)

    def moves_words(self, dst: int, now: float) -> list[str]:
        """A sentence on bursts to `dst`, if they are short because a channel changes."""
        doppler_hz, src = self._motion.fastest({dst}, now)
        bound_s = longest_burst_s(doppler_hz)
        if bound_s >= self._fit.most_s:
            return []
        words = (
            f"its bursts are at most {1e3 * bound_s:.2g} ms long: the channel to robot {src} "
            f"changes at {doppler_hz:.2g} Hz, as on the move"
        )
        return [words]

    def report(self) -> TransmitReport:
        """The report on what was sent so far, and how."""
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
        """The first burst of the retry queue in a new slot; None if there is no slot yet."""
        again = self._retry.waiting[0]
        airtime_s = opportunity.airtime_s(again.mcs, len(again.pdus))
        waiting = None if self._bids is None else self._bids.waiting()
        slot = self._access.slot(
            Wish(opportunity.earliest, again.qos, airtime_s, opportunity.sensed, waiting)
        )
        if slot is None or slot.start + airtime_s > slot.end:
            return None
        if slot.is_pulse:
            return self._pulse(slot.start, again.qos)
        burst = self._retry.take(slot.start)
        self._access.sent(slot.start + airtime_s, self._relayed_src(burst.pdus))
        self._entry_ids.left(chain.from_iterable(burst.carried), slot.start)
        is_timed = again.latest <= again.start
        latest = slot.start if is_timed else max(slot.start, slot.late_end - airtime_s)
        return burst._replace(latest=latest)

    def _repeat(self, opportunity: Opportunity, due: Sequence[Wanted]) -> Burst | None:
        """A burst with some of the PDUs that are `due`; None if it cannot leave now."""
        repetitions, access = self._repetitions, self._access
        planned = repetitions.plan(opportunity, due, access)
        if planned is None:
            return None
        slot, qos = planned.slot, planned.group.qos
        if slot.is_pulse:
            return self._pulse(slot.start, qos)
        if self._sealing.is_on and not self._may_seal(slot.start, 1):
            return None
        most = self._allowance(slot, planned.mcs, opportunity, qos).most[qos]
        burst = repetitions.burst(planned, most, opportunity.airtime_s, self._ready_at)
        if burst is None:
            return None
        self._spend(burst.airtime_s, burst.classes)
        access.sent(burst.start + burst.airtime_s, self._relayed_src(burst.pdus))
        if burst.repeated is not None:
            self._ready_at = None
            for kept in burst.repeated.kept:
                for message in kept.carried:
                    message.owe(len(kept.octets) / len(kept.carried))
        self._number += 1
        return burst._replace(number=self._number)

    def _in_the_clear(self, slot: Slot, length_s: float) -> Burst | None:
        """A burst of a PDU in the clear, if one is due where nothing can be sealed."""
        start, records = slot.start, self._control_records
        asks = self._sealing.is_lost and length_s <= slot.end - start
        built = records.told_in_clear(start) if asks else None
        if built is None:
            return None
        self._control_airtime_s += length_s
        records.told_alone(start)
        self._spend(length_s, [built.qos])
        self._access.sent(start + length_s, None)
        ready_at, self._ready_at = self._ready_at or start, None
        self._number += 1
        return Burst(
            [built.data], [[]], [built.qos], self._rate.lowest, Qos.DEFAULT, start,
            max(start, slot.late_end - length_s), length_s, self._number,
            first_start=start, n_records=1, ready_at=ready_at, planned_start=start,
            inner=[b""], numbers=[self._composer.next_number],
        )  # fmt: skip

    def _pulse(self, start: float, qos: Qos) -> Burst:
        """A pulse of energy, by which the access policy tells that we have something to send."""
        self._number += 1
        return Burst.of_pulse(start, self._pulse_s, qos, self._number)

    def _may_seal(self, start: float, n: int) -> bool:
        """Whether there are numbers for `n` PDUs of ours in a burst at `start`."""
        if self._sealing.may_send(start, self._composer.next_number & 0xFF, n):
            return True
        self._numbers_at = start + TICK_S
        return False

    def _fill(
        self, start: float, allowance: Allowance, cannot_wait: bool, bid: Bid | None
    ) -> tuple[list[BuiltPdu], int]:
        """(PDUs, how many of them hold only records) of a burst at `start`, which tells `bid`.

        A record that is due uses spare room. It gets its own PDU if traffic leaves no room for too
        long, or if there is no traffic.
        """
        composer, records = self._composer, self._control_records
        told = b"" if bid is None else bid.octets
        may_tell = allowance.most[Qos.DEFAULT] > 0
        if cannot_wait and may_tell:
            # Records come after more urgent classes. Only our own PDUs may precede them: clocks
            # cannot wait until all relayed PDUs are sent, and a burst has only one source.
            built = composer.fill(start, allowance.above(Qos.DEFAULT), self._own_id, told=told)
        else:
            built = composer.fill(start, allowance, told=told)
            # With a bid, the others wait for a burst, even if nothing is left to tell.
            if built or not may_tell or not (bid is not None or records.is_due(start)):
                return built, 0
        first = [] if bid is None or built else [bid.record]
        alone = composer.fill_with_records(start, first)
        key = records.told_in_clear(start) if len(built) + len(alone) < MAX_PDUS else None
        if key is not None:
            alone.append(key)
        return built + alone, len(alone)

    def _allowance(
        self, slot: Slot, mcs: int, opportunity: Opportunity, further: Qos | None
    ) -> Allowance:
        """How many PDUs of each class a burst in `slot` may hold.

        `further`: the class of what is sent besides messages: records, or repeated PDUs.
        """
        airtime_s, made_by, longest_s = (
            opportunity.airtime_s, opportunity.made_by, slot.end - slot.start
        )  # fmt: skip
        access, fit = self._access, self._fit
        asked = self._outbox.waiting_classes()
        one_s, two_s = airtime_s(mcs, 1), airtime_s(mcs, 2)
        # Bursts of records alone, such as beacons, are slower than those of messages.
        if asked and two_s > one_s:
            self.bytes_per_s = self._composer.k_single / (two_s - one_s)
        if further is not None:
            asked.add(further)
        most_s = inf
        if self._motion.knows_some:
            most_s = self._motion.longest_s(self._outbox.destinations(), slot.start)
        if made_by is not None:
            most_s = min(most_s, made_by(slot.start))
        most_s = min(longest_s, max(one_s, most_s))
        if self._turns is not None:
            # Turns are short enough for what is urgent.
            most = opportunity.most_pdus(mcs, most_s)
            allowance = Allowance(tuple(most if qos in asked else 0 for qos in Qos))
        else:
            allowance = self._limits.allow(
                slot.start,
                most_s,
                partial(airtime_s, mcs),
                partial(opportunity.most_pdus, mcs),
                fit.lead_s - access.pause_s,
                fit.notice_s,
                access.others_follow,
                asked,
                has_slots=access.share < 1,
            )
        if self._bids is not None:
            # The others have left the air to us, and wait for a burst.
            allowance = allowance.at_least_one(asked)
        if slot.least < Qos.BULK:
            allowance = allowance.least(slot.least)
        if not self._shares.is_owed or one_s > longest_s:
            return allowance
        return allowance._replace(owed=tuple(self._shares.owed(two_s - one_s)))

    def _spend(self, length_s: float, classes: list[Qos]) -> None:
        """Charge a burst of `length_s` to the classes of its PDUs."""
        each_s = length_s / len(classes)
        for qos in classes:
            self._used_s[qos] += each_s
        if self._outbox.levels or self._shares.is_owed:
            self._shares.spend(length_s, classes, self._outbox.waiting_classes())

    def _kept_free(self, start: float) -> None:
        """Account for the time in which the channel was kept free for a more urgent message."""
        held, self._held = self._held, _NOT_HELD
        passed_s = min(start, held.until) - held.since
        if passed_s > 0:
            self._limits.kept_free(passed_s)
            self._shares.idle(passed_s, self._outbox.waiting_classes())

    def _sealed(self, pdus: list[bytes], start: float) -> tuple[list[bytes], list[bytes]]:
        """The PDUs of a burst at `start` for the air, and what is inside our own sealed ones."""
        own, size = self._own_id, self._clear_size
        inner = [pdu if pdu[1] == own and len(pdu) != size else b"" for pdu in pdus]
        seal = self._sealing.seal
        sealed = [
            seal(plain, start) if plain else pdu for pdu, plain in zip(pdus, inner, strict=True)
        ]
        return sealed, inner

    def _relayed_src(self, pdus: list[bytes]) -> int | None:
        """The robot whose PDUs a burst relays; None: our own."""
        src = pdus[0][1]
        return None if src == self._own_id else src
