"""Beacons: what a node announces about itself and its neighbors, about once a second."""

from math import inf
from random import Random

from sdrlinkd.link.receive import Neighbors
from sdrlinkd.link.transmit.rate import RateControl
from sdrlinkd.wire import Beacon, LinkReport, Record, RegistryDigest, build_records, equal_payload

# Keeps the beacons of robots that started together from colliding forever.
JITTER = 0.1
REPORTED_PERIODS = 2
"""Robots that were heard within so many periods are reported; we may have sent nothing for long."""
SNR_RANGE = (-128, 127)


class Beacons:
    """Decides when the next beacon is due, and makes its records."""

    def __init__(self, period_s: float, pdu_size: int, digest: RegistryDigest, rng: Random) -> None:
        self._period_s = period_s
        self._rng = rng
        self._digest = digest
        room = equal_payload(pdu_size, 1)
        if len(build_records([digest])) > room:
            self._digest = digest.shortened()
        fits = len(build_records([Beacon(0, 0, 0), self._digest])) <= room
        self._told = 0 if fits else None
        """The place of the PDU number, if there is room for it."""
        self.boot_id = rng.randrange(1 << 16)
        self._number = 0
        self.due_at = 0.0 if period_s > 0 else inf

    def end(self) -> None:
        """Send no more beacons."""
        self.due_at = inf

    def take(self, start: float, neighbors: Neighbors, rate: RateControl) -> list[Record]:
        """The records of a beacon in a burst that leaves at `start`: our identity, and how well we
        hear each of `neighbors`.
        """
        records: list[Record] = [Beacon(self.boot_id, self._number, self._told), self._digest]
        self._number = (self._number + 1) & 0xFFFF
        self.due_at = start + self._period_s * self._rng.uniform(1 - JITTER, 1 + JITTER)
        since = start - REPORTED_PERIODS * self._period_s
        for src, snr_db, per in neighbors.take_qualities(since):
            low, high = SNR_RANGE
            quarters = min(max(round(4 * snr_db), low), high)
            records.append(LinkReport(src, quarters, round(255 * per), rate.suggested(snr_db)))
        return records
