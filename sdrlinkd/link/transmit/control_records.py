"""When CLOCK and RECEIPT records go: in spare room, or in PDUs that take a bounded share of air."""

from collections.abc import Mapping
from math import inf

from sdrlinkd.link.packing import PiggybackRecords
from sdrlinkd.link.receive import Neighbor
from sdrlinkd.link.timesync import ClockParams, Clocks
from sdrlinkd.link.transmit.burst import Burst
from sdrlinkd.wire import ARRIVAL_SIZE, CLOCK_SIZE, Receipt, RecordType

PATIENCE_S = 0.05
"""What a RECEIPT waits for spare room at least."""
PRESENT_S = 10.0
"""A robot not heard for so long takes no share of the air."""
MOST_RECEIPTS = 256
LESS = 1.05
"""A little less than the share, for robots not heard yet."""


class ControlRecords:
    """Records that are not a beacon's. A PDU with nothing else has room for `record_room` octets of
    them, and takes `pdu_s` of airtime.
    """

    def __init__(
        self,
        params: ClockParams,
        clocks: Clocks,
        piggyback: PiggybackRecords,
        neighbors: Mapping[int, Neighbor],
        record_room: int,
    ) -> None:
        self._params = params
        self._clocks = clocks
        self._piggyback = piggyback
        self._neighbors = neighbors
        self._most_arrivals = (record_room - CLOCK_SIZE) // ARRIVAL_SIZE
        self.fits = self._most_arrivals > 0 or not params.period_s
        """Whether PDUs have room for clocks, if there are any to be told."""
        if not self.fits:
            clocks.end()
        self.pdu_s = 0.0
        self._told_alone_at = self._told_at = -inf
        self._tells_at = 0.0
        self._overdue_at = inf
        self._waits = False
        self._others = 0
        self.period_s = params.period_s
        """Between PDUs of our own with nothing else."""

    @property
    def next_alone_at(self) -> float:
        """From when on a PDU with nothing else may go, if something waits by then."""
        if not self._others:
            return self._piggyback.due_at
        return min(self._clock_alone_at, self._piggyback.due_at)

    def alone_at(self, at: float) -> float:
        """From when on what should go at `at` may have a PDU with nothing else."""
        return max(at, self._told_alone_at + self.period_s) if self._others else at

    def look_round(self, now: float, own_id: int) -> None:
        """Who else is there: nobody else wants to know our clock, and all share the air."""
        self._others = sum(
            now - each.last_heard_at < PRESENT_S
            for each in self._neighbors.values()
            if each.src != own_id
        )
        needed_s = LESS * (1 + self._others) * self.pdu_s / self._params.share
        self.period_s = max(self._params.period_s, needed_s)

    @property
    def _clock_alone_at(self) -> float:
        """From when on the next CLOCK does not wait for spare room."""
        if self._clocks.due_at == inf:
            return inf
        return max(self._told_at + self._params.period_s, self._told_alone_at + self.period_s)

    def tell(self, start: float) -> bool:
        """Have a CLOCK ride in the burst at `start`, if it is time; whether it cannot wait."""
        if start < self._clocks.due_at or not self._others:
            return False
        waits = self._piggyback.holds(RecordType.CLOCK)
        alone_at = max(start, self._clock_alone_at)
        self._tells_at = start
        self._piggyback.put(self._clocks.record(start, self._most_arrivals), alone_at)
        self._waits = True
        if not waits:
            self._overdue_at = alone_at + self.period_s
        return start >= self._overdue_at

    def receipt(self, receipt: Receipt, now: float) -> bool:
        """Have it told; False where too many wait already."""
        if self._piggyback.count(RecordType.RECEIPT) >= MOST_RECEIPTS:
            return False
        alone_at = self.alone_at(now + PATIENCE_S)
        self._piggyback.put_receipt(receipt, alone_at, now)
        return True

    def took(self, burst: Burst | None) -> Burst | None:
        """A burst that was just composed, with the number of the CLOCK in it."""
        waits, self._waits = self._waits, self._piggyback.holds(RecordType.CLOCK)
        if burst is None or self._waits or not waits:
            return burst
        self._told_at = self._tells_at
        return burst._replace(clock=self._clocks.rode())

    def told_alone(self, start: float) -> None:
        """A PDU with nothing but records leaves."""
        self._told_alone_at = start

    def left(self, burst: Burst) -> None:
        """A burst has left."""
        if burst.clock is not None:
            self._clocks.left(burst.clock, burst.start)

    def end(self) -> None:
        """No more."""
        self._clocks.end()
