"""When control records go: in spare room, or in PDUs that take a bounded share of the air.

Four kinds of them have one pace here: beacons (with digest, link reports and WAITS), the schedule
of the access policy (FRAME), clocks (CLOCK), and RECEIPTs. Each is made when its time has come,
rides where a broadcast PDU has room, and knows from when on it deserves a PDU of its own. That
costs air which messages could have, and a half-duplex radio is deaf meanwhile. So PDUs with nothing
but records take no more than `clock.share` of it, all robots taken together: with n robots, one has
such a PDU every n · pdu_s / share at most. Beacons are held to that, too, unless rate control or a
schedule lives on them.
"""

from math import inf

from sdrlinkd.link.packing import PiggybackRecords
from sdrlinkd.link.receive import Neighbors
from sdrlinkd.link.timesync import ClockParams, Clocks
from sdrlinkd.link.transmit.beacons import Beacons
from sdrlinkd.link.transmit.rate import RateControl
from sdrlinkd.link.transmit.tx_delay import TxDelayMeters
from sdrlinkd.wire import ARRIVAL_SIZE, CLOCK_SIZE, Frame, Receipt, Record, RecordType

PATIENCE_S = 0.05
"""What a RECEIPT waits for spare room at least."""
MOST_RECEIPTS = 256
LESS = 1.05
"""A little less than the share, for robots not heard yet."""


class ControlRecords:
    """Makes records when they are due, and says when one deserves a PDU of its own.

    `record_room`: octets of records in a PDU with nothing else.
    """

    def __init__(
        self,
        params: ClockParams,
        clocks: Clocks,
        beacons: Beacons,
        tx_delays: TxDelayMeters,
        piggyback: PiggybackRecords,
        neighbors: Neighbors,
        record_room: int,
    ) -> None:
        self._params = params
        self._clocks = clocks
        self._beacons = beacons
        self._tx_delays = tx_delays
        self._piggyback = piggyback
        self._neighbors = neighbors
        self._most_arrivals = (record_room - CLOCK_SIZE) // ARRIVAL_SIZE
        self.fits = self._most_arrivals > 0 or not params.period_s
        """Whether PDUs have room for clocks, if there are any to be told."""
        if not self.fits:
            clocks.end()
        self.period_s = params.period_s
        """Between PDUs of our own with nothing but records, in s."""
        self.clock_waits = False
        """Whether a CLOCK waits for a burst."""
        self.receipts_untold = 0
        """RECEIPTs to others that found no room."""
        self._n_others = 0
        # Starts of the bursts with the last CLOCK, and with the last PDU of records alone.
        self._clock_told_at = self._told_alone_at = -inf
        self._clock_offered_at = 0.0
        self._clock_overdue_at = inf

    @property
    def due_at(self) -> float:
        """From when on a PDU with nothing but records may go."""
        due_at = min(self._beacons.due_at, self._piggyback.due_at)
        return min(due_at, self._clock_alone_at) if self._n_others else due_at

    def is_due(self, start: float) -> bool:
        """Whether a record that waits deserves a PDU of its own at `start`."""
        return self._piggyback.due_at <= start

    def tells_schedule(self, start: float) -> bool:
        """Whether a burst at `start` may hold the schedule, whose phase is that of its start."""
        return start >= self._beacons.due_at or self._piggyback.holds(RecordType.FRAME)

    def collect(self, start: float, frame: Frame | None, rate: RateControl) -> bool:
        """Make what is due for a burst at `start`; whether something cannot wait for spare room.

        `frame` is the schedule that the access policy keeps, if any.
        """
        cannot_wait = False
        if start >= self._beacons.due_at:
            # The beacon before found no room for a whole period.
            cannot_wait = self.is_due(start)
            self._offer_beacon(start, frame, rate)
        elif frame is not None and self._piggyback.holds(RecordType.FRAME):
            self._piggyback.renew(frame)
            # A schedule does not wait for spare room.
            cannot_wait = True
        if start >= self._clocks.due_at and self._n_others:
            self._offer_clock(start)
            cannot_wait = cannot_wait or start >= self._clock_overdue_at
        return cannot_wait

    def took_clock(self) -> int | None:
        """The number of the CLOCK that the burst just composed holds; None: it still waits."""
        self.clock_waits = self._piggyback.holds(RecordType.CLOCK)
        if self.clock_waits:
            return None
        self._clock_told_at = self._clock_offered_at
        return self._clocks.rode()

    def told_alone(self, start: float) -> None:
        """Note that a PDU with nothing but records leaves at `start`."""
        self._told_alone_at = start

    def left(self, clock: int, start: float) -> None:
        """Note that the burst with that CLOCK has left at `start`."""
        self._clocks.left(clock, start)

    def receipt(self, receipt: Receipt, now: float) -> None:
        """Have a RECEIPT told of what came about at `now`, unless too many wait already."""
        if self._piggyback.count(RecordType.RECEIPT) >= MOST_RECEIPTS:
            self.receipts_untold += 1
            return
        self._piggyback.put_receipt(receipt, self._alone_from(now + PATIENCE_S), now)

    def look_round(self, now: float, pdu_s: float) -> None:
        """See who else is there: nobody else wants to know our clock, and all share the air.

        `pdu_s` is the airtime of a PDU with nothing but records.
        """
        self._n_others = len(self._neighbors.present(now))
        needed_s = LESS * (1 + self._n_others) * pdu_s / self._params.share
        self.period_s = max(self._params.period_s, needed_s)

    def end(self) -> None:
        """Make no more beacons and clocks."""
        self._beacons.end()
        self._clocks.end()

    @property
    def _clock_alone_at(self) -> float:
        """From when on the next CLOCK does not wait for spare room."""
        if self._clocks.due_at == inf:
            return inf
        return max(self._clock_told_at + self._params.period_s, self._told_alone_at + self.period_s)

    def _alone_from(self, at: float) -> float:
        """From when on what should go at `at` may have a PDU with nothing else."""
        return max(at, self._told_alone_at + self.period_s) if self._n_others else at

    def _offer_beacon(self, start: float, frame: Frame | None, rate: RateControl) -> None:
        records: list[Record] = self._beacons.take(start, self._neighbors, rate)
        records += self._tx_delays.records()
        if frame is not None:
            records.append(frame)
        # Rate control and schedules live on beacons; all else bears a wait.
        is_needed = rate.adapts or frame is not None
        self._piggyback.offer(records, start if is_needed else self._alone_from(start))

    def _offer_clock(self, start: float) -> None:
        waited = self._piggyback.holds(RecordType.CLOCK)
        alone_at = max(start, self._clock_alone_at)
        self._clock_offered_at = start
        self._piggyback.put(self._clocks.record(start, self._most_arrivals), alone_at)
        self.clock_waits = True
        if not waited:
            self._clock_overdue_at = alone_at + self.period_s
