"""Times the sending of control records: in spare room, or in PDUs with a bounded share of airtime.

It handles several kinds of records: beacons (with digest, link reports and WAITS), the schedule of
the access policy (FRAME), clocks (CLOCK), RECEIPTs, declarations (TOPIC), what consumers here
subscribe to (WANTED), the PDUs that we lack (NEED), links and routes (LSA, ROUTE), flows that
reserve air (FLOWS, ADMIT), and the proof that we are alive (CONTACT). Each record is made when it
is due, uses spare room in a broadcast PDU, and from a certain time on gets its own PDU. Such a PDU
takes airtime from messages, and a half-duplex radio is deaf while it sends. So PDUs that hold only
records take at most `clock.share` of the airtime, all robots together: with n robots, each sends at
most one such PDU every n · pdu_s / share. This limits beacons, too, unless rate control or a
schedule depends on them. Declarations, questions, routes and flows have shares of their own.
"""

from collections.abc import Iterable
from math import inf

from sdrlinkd.link.packing import BuiltPdu, PiggybackRecords
from sdrlinkd.link.qos import Qos
from sdrlinkd.link.receive import Neighbors
from sdrlinkd.link.repeat import Asking
from sdrlinkd.link.routes import Routes
from sdrlinkd.link.schedule import Budget, ToldOfAir
from sdrlinkd.link.timesync import ClockParams, Clocks
from sdrlinkd.link.topics import TopicTeller, Wants
from sdrlinkd.link.transmit.beacons import Beacons
from sdrlinkd.link.transmit.rate import RateControl
from sdrlinkd.link.transmit.tx_delay import TxDelayMeters
from sdrlinkd.sealing import InTheClear, Sealing
from sdrlinkd.wire import (
    ARRIVAL_SIZE,
    BROADCAST,
    CLOCK_SIZE,
    CONTROL_TOPIC_ID,
    PDU_NUMBER_SIZE,
    Entry,
    Frame,
    Pdu,
    RatesAsked,
    Receipt,
    Record,
    RecordType,
    build,
    build_records,
)

PATIENCE_S = 0.05
"""Shortest time in s that a RECEIPT or a WANTED waits for spare room."""
MOST_RECEIPTS = 256
ROUTES_SHARE = FLOWS_SHARE = 0.02
"""Largest shares of the airtime for PDUs with only LSA, ROUTE, and answers to them, and with only
FLOWS and ADMIT; the latter is that of all robots together."""
FOUND_SHARE = 0.02
"""Largest share of the airtime of all robots for PDUs with only answers about lost numbers."""
UNANSWERED = 4
"""How many robots share the airtime for records, whether they hear us or not."""
MOST_BEACON_S = 5.0
"""Longest time in s between two beacons, however many robots are heard."""
LESS = 1.05
"""Factor on the period, which leaves a little of the share for robots not heard yet."""


class ControlRecords:
    """Makes control records when they are due, and decides when one gets its own PDU.

    `record_room` is the number of record octets in a PDU that holds only records. PDUs in the clear
    have `clear_size` octets.
    """

    def __init__(
        self, params: ClockParams, clocks: Clocks, beacons: Beacons, tx_delays: TxDelayMeters,
        piggyback: PiggybackRecords, neighbors: Neighbors, teller: TopicTeller, wants: Wants,
        sealing: Sealing | InTheClear, asking: Asking, routes: Routes, record_room: int,
        own_id: int, clear_size: int,
    ) -> None:  # fmt: skip
        self._sealing = sealing
        self._asking = asking
        self._routes = routes
        self._route_budget = Budget(ROUTES_SHARE)
        self._air_budget = Budget(FLOWS_SHARE)
        self._found_budget = Budget(FOUND_SHARE)
        self._own_id = own_id
        self._clear_size = clear_size
        self._params = params
        self._clocks = clocks
        self._beacons = beacons
        self._tx_delays = tx_delays
        self._piggyback = piggyback
        self._neighbors = neighbors
        self._teller = teller
        self._wants = wants
        self._room = record_room
        self._told_version = 0
        self._is_numbered = record_room >= CLOCK_SIZE + PDU_NUMBER_SIZE + ARRIVAL_SIZE
        """Whether CLOCK has room for the number of its PDU."""
        room = record_room - CLOCK_SIZE - PDU_NUMBER_SIZE * self._is_numbered
        self._most_arrivals = room // ARRIVAL_SIZE
        self.fits = self._most_arrivals > 0 or not params.period_s
        """Whether PDUs have room for CLOCK records, if these are configured."""
        if not self.fits:
            clocks.end()
        self.period_s = params.period_s
        """Shortest time in s between our PDUs that hold only records."""
        self.clock_waits = False
        """Whether a CLOCK waits for a burst."""
        self.questions_wait = False
        """Whether NEED records wait for a burst."""
        self.receipts_untold = 0
        """RECEIPT records for others that were never sent, as too many were waiting."""
        self._n_others = 0
        self._beacon_since = 0.0
        """Since when a beacon waits."""
        # Starts of the bursts with the last CLOCK, and with the last PDU of only records.
        self._clock_told_at = self._told_alone_at = -inf
        self._clock_offered_at = 0.0
        self._clock_overdue_at = inf

    @property
    def due_at(self) -> float:
        """Time from which a PDU with only records may be sent."""
        due_at = min(self._beacons.due_at, self._piggyback.due_at, self._sealing.clear_due_at)
        if self._asking.alone_at < inf:
            due_at = min(due_at, self._asking.alone_at)
        return min(due_at, self._clock_alone_at) if self._n_others else due_at

    def is_due(self, start: float) -> bool:
        """Whether a waiting record gets its own PDU at `start`."""
        return min(self._piggyback.due_at, self._sealing.clear_due_at) <= start

    def tells_schedule(self, start: float) -> bool:
        """Whether a burst at `start` may hold the schedule, whose phase depends on the start."""
        return start >= self._beacons.due_at or self._piggyback.holds(RecordType.FRAME)

    def collect(self, start: float, frame: Frame | None, rate: RateControl) -> bool:
        """Make the records that are due for a burst at `start`.

        Returns whether a record cannot wait for spare room. `frame` is the access policy's
        schedule, if any.
        """
        cannot_wait = False
        if self._teller.topics.version != self._told_version:
            # With the topic's first messages, if these leave room.
            self._offer_topics(start)
        if start >= self._beacons.due_at:
            # The last beacon has found no room for a whole period.
            cannot_wait = self.is_due(start)
            self._offer_beacon(start, frame, rate)
        elif frame is not None and self._piggyback.holds(RecordType.FRAME):
            self._piggyback.renew(frame)
            # A schedule must not wait for spare room.
            cannot_wait = True
        if start >= self._clocks.due_at and self._n_others:
            self._offer_clock(start)
            cannot_wait = cannot_wait or start >= self._clock_overdue_at
        if self._asking.due_at <= start or self._asking.is_offered:
            questions = self._asking.questions(start)
            self._piggyback.put_needs(questions, self._asking.offered_alone_at)
            self.questions_wait = self._asking.is_offered
            cannot_wait = cannot_wait or self._piggyback.is_overdue(RecordType.NEED, start)
        if self._sealing.is_on:
            self._offer_contact(start)
            # Nothing of ours is believed before others have it.
            cannot_wait = cannot_wait or self._piggyback.is_overdue(RecordType.CONTACT, start)
        return cannot_wait

    def took_clock(self) -> int | None:
        """The number of the CLOCK in the burst just composed; None: the CLOCK still waits."""
        self.clock_waits = self._piggyback.holds(RecordType.CLOCK)
        if self.clock_waits:
            return None
        self._clock_told_at = self._clock_offered_at
        return self._clocks.rode()

    def took_questions(self, start: float, alone_s: float) -> None:
        """Note which questions are in the burst just composed, for `start`.

        `alone_s` is the airtime of its PDUs that hold only records.
        """
        self._asking.asked(start, self._piggyback.asked_nodes(), alone_s)
        self.questions_wait = self._asking.is_offered

    def told_alone(self, start: float) -> None:
        """Note that a PDU with only records leaves at `start`."""
        self._told_alone_at = start

    def left(self, clock: int, start: float) -> None:
        """Note that the burst with CLOCK number `clock` left at `start`."""
        self._clocks.left(clock, start)

    def receipt(self, receipt: Receipt, now: float) -> None:
        """Queue a RECEIPT for an event at `now`, unless too many are waiting."""
        if self._piggyback.count(RecordType.RECEIPT) >= MOST_RECEIPTS:
            self.receipts_untold += 1
            return
        self._piggyback.put_receipt(receipt, self._alone_from(now + PATIENCE_S), now)

    def look_round(self, now: float, pdu_s: float) -> None:
        """Count the other robots present, which need our clock and share the airtime.

        `pdu_s` is the airtime of a PDU with only records, in s.
        """
        present = self._neighbors.present(now)
        self._n_others = len(present)
        # Anybody can pretend to be many robots, of which none answers.
        n_answering = sum(self._clocks.has_contact(src, now) for src in present)
        n_sharing = min(len(present), UNANSWERED + 2 * n_answering)
        needed_s = LESS * (1 + n_sharing) * pdu_s / self._params.share
        self.period_s = max(self._params.period_s, needed_s)

    def tell_topics(self, now: float, pdu_s: float) -> None:
        """Offer the declarations of topics, and the wants, that are due at `now`.

        Declarations use spare room or, within their share of the air, PDUs of `pdu_s` of their own.
        """
        for wanted in self._wants.due(now, self._neighbors.present(now)):
            if isinstance(wanted, RatesAsked):
                key = RecordType.RATE, wanted.node, *wanted.periods[0][:1]
            else:
                key = RecordType.WANTED, wanted.node, *wanted.topics[:1]
            self._piggyback.put_as(key, wanted, self._alone_from(now + PATIENCE_S))
        self._offer_contact(now)
        self._offer_found(now, pdu_s)
        self._offer_topics(now)
        if self._piggyback.holds(RecordType.TOPIC) and self._teller.may_pay(now, pdu_s):
            self._piggyback.make_due(RecordType.TOPIC, self._room, now)

    def tell_routes(self, now: float, pdu_s: float) -> None:
        """Offer what others must know of links and routes, in PDUs of `pdu_s` if there is no room.

        These have a share of the air of their own.
        """
        for record, key, alone_at in self._routes.told(now):
            due_at = max(alone_at, self._route_budget.free_at(now))
            self._piggyback.put_as(key, record, due_at)
            self._route_budget.spend(pdu_s, now, is_bounded=True)

    def tell_air(self, records: Iterable[ToldOfAir], now: float, pdu_s: float) -> None:
        """Offer what others must know of flows, in PDUs of `pdu_s` if there is no room."""
        for record, key, alone_at in records:
            self._piggyback.put_as(key, record, max(alone_at, self._air_budget.free_at(now)))
            part = len(build_records([record])) / max(1, self._room)
            self._air_budget.spend((1 + self._n_others) * part * pdu_s, now, is_bounded=True)

    def told_in_clear(self, start: float) -> BuiltPdu | None:
        """A PDU in the clear with the record that is due at `start`, if one is."""
        if start < self._sealing.clear_due_at:
            return None
        told = self._sealing.told_in_clear(start)
        entry = Entry(CONTROL_TOPIC_ID, 0, 0, 1, build_records([told]))
        pdu = Pdu(0, False, self._own_id, BROADCAST, 0, 1, [entry])
        return BuiltPdu(build(pdu, self._clear_size), [], Qos.DEFAULT)

    def newcomer(self, now: float) -> None:
        """Tell all declared topics again, as a robot was heard for the first time."""
        self._teller.newcomer(now)

    def end(self) -> None:
        """Send no more beacons and CLOCK records."""
        self._beacons.end()
        self._clocks.end()

    @property
    def _clock_alone_at(self) -> float:
        """Time from which the next CLOCK gets its own PDU."""
        if self._clocks.due_at == inf:
            return inf
        return max(self._clock_told_at + self._params.period_s, self._told_alone_at + self.period_s)

    def _alone_from(self, at: float) -> float:
        """Earliest time from `at` on for a PDU that holds only records."""
        return max(at, self._told_alone_at + self.period_s) if self._n_others else at

    def _offer_contact(self, now: float) -> None:
        if now >= self._sealing.contact_due_at:
            contact, alone_at = self._sealing.contact(now, self._room)
            self._piggyback.put(contact, self._alone_from(alone_at))

    def _offer_found(self, now: float, pdu_s: float) -> None:
        """Answer robots that have lost their numbers; anybody can ask, so this has a share."""
        if self._piggyback.holds(RecordType.FOUND):
            return
        for found in self._sealing.found(now):
            key = RecordType.FOUND, found.node, int.from_bytes(found.number)
            free_at = self._found_budget.free_at(now)
            self._piggyback.put_as(key, found, max(self._alone_from(now + PATIENCE_S), free_at))
            self._found_budget.spend((1 + self._n_others) * pdu_s, now, is_bounded=True)

    def _offer_topics(self, now: float) -> None:
        self._told_version = self._teller.topics.version
        for piece in self._teller.due(now):
            self._piggyback.put_topic(piece)

    def _offer_beacon(self, start: float, frame: Frame | None, rate: RateControl) -> None:
        records: list[Record] = self._beacons.take(start, self._neighbors, rate)
        records += self._tx_delays.records()
        digest = self._routes.digest()
        if digest is not None:
            self._piggyback.put_as((RecordType.LSA, digest.node), digest, inf)
        if frame is not None:
            records.append(frame)
        further = self._sealing.further_key()
        if further is not None:
            records.append(further)
        # Rate control and schedules depend on beacons; all other records can wait.
        is_needed = rate.adapts or frame is not None
        if not self._piggyback.holds(RecordType.BEACON):
            self._beacon_since = start
        alone_at = min(self._alone_from(start), max(start, self._beacon_since + MOST_BEACON_S))
        self._piggyback.offer(records, start if is_needed else alone_at)

    def _offer_clock(self, start: float) -> None:
        waited = self._piggyback.holds(RecordType.CLOCK)
        alone_at = max(start, self._clock_alone_at)
        self._clock_offered_at = start
        clock = self._clocks.record(start, self._most_arrivals, is_numbered=self._is_numbered)
        self._piggyback.put(clock, alone_at)
        self.clock_waits = True
        if not waited:
            self._clock_overdue_at = alone_at + self.period_s
