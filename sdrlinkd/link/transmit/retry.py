"""Bursts that came too late for their slot: nothing of them left, so they may go again."""

from bisect import insort

from sdrlinkd.link.transmit.burst import Burst
from sdrlinkd.wire import postponed

GIVE_UP_S = 2.0
"""A burst that still has found no slot in time so long after its first is given up."""


class RetryQueue:
    """The same PDUs wait for another slot, in their order; ages inside grow with the wait."""

    def __init__(self, has_control: bool) -> None:
        self._has_control = has_control
        self.waiting: list[Burst] = []
        """The bursts that go again, in the order in which they were composed."""
        self.count = 0
        """Bursts that were given back so far."""

    def give_back(self, burst: Burst) -> bool:
        """Keep a burst that did not leave; False when it has been tried for long enough."""
        self.count += 1
        if burst.start - burst.first_start > GIVE_UP_S:
            return False
        insort(self.waiting, burst, key=lambda each: each.number)
        return True

    def clear(self) -> None:
        """Forget the bursts that go again."""
        self.waiting.clear()

    def take(self, start: float) -> Burst:
        """The burst that goes next, as it leaves at `start`."""
        burst = self.waiting.pop(0)
        pdus = burst.pdus
        by_us = round(1e6 * (start - burst.start))
        if self._has_control and by_us > 0:
            pdus = [postponed(pdu, by_us) for pdu in pdus]
        return burst._replace(pdus=pdus, start=start)
