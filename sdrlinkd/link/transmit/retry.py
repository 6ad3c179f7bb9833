"""The retry queue: bursts that missed their slot and are sent in a later one."""

from bisect import insort
from collections.abc import Callable

from sdrlinkd.link.transmit.burst import Burst
from sdrlinkd.sealing import InTheClear, Sealing

GIVE_UP_S = 2.0
"""Time in s after its first slot after which a burst that missed all its slots is given up."""


class RetryQueue:
    """Late bursts that wait for another slot, in order; the ages inside grow with the wait."""

    def __init__(self, sealing: Sealing | InTheClear, take_number: Callable[[], int]) -> None:
        self._sealing = sealing
        self._take_number = take_number
        self.waiting: list[Burst] = []
        """The waiting bursts, in the order in which they were composed."""
        self.count = 0
        """Number of late bursts so far."""

    def give_back(self, burst: Burst, now: float) -> bool:
        """Queue a burst that missed its slot; False if it is in vain, or was tried for too long."""
        self.count += 1
        if burst.is_in_vain(now) or burst.start - burst.first_start > GIVE_UP_S:
            return False
        insort(self.waiting, burst, key=lambda each: each.number)
        return True

    def clear(self) -> None:
        """Drop all waiting bursts."""
        self.waiting.clear()

    def take(self, start: float) -> Burst:
        """Take out the next burst, adjusted to leave at `start`."""
        burst = self.waiting.pop(0)
        by_us, inner = round(1e6 * (start - burst.start)), burst.inner or [b""] * len(burst.pdus)
        numbers = list(burst.numbers)
        moved = []
        for i, each in enumerate(zip(burst.pdus, inner, strict=True)):

            def next_seq(i: int = i) -> int:
                numbers[i] = number = self._take_number()
                return number & 0xFF

            moved.append(self._sealing.later(*each, by_us, start, next_seq))
        return burst._replace(
            pdus=[pdu for pdu, _ in moved],
            inner=[each for _, each in moved],
            start=start,
            planned_start=start,
            numbers=numbers,
        )
