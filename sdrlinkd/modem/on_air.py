"""Bursts that were handed to the modem and are not settled yet."""

import math

from sdrlinkd.link import Burst, Outcome
from sdrlinkd.modem.modem import BurstOrder, BurstReport


class OnAir:
    """Bursts on the way, by the number of their order; false if there are none."""

    def __init__(self) -> None:
        self._bursts: dict[int, Burst] = {}
        self._number = 0
        self._late = 0

    def __len__(self) -> int:
        return len(self._bursts)

    def add(self, burst: Burst, start: int, rate_hz: float) -> BurstOrder:
        """Note a burst whose first sample has index `start`, and return its order."""
        latest = None
        if burst.latest != math.inf:
            # `start` is rounded to a sample; `latest` may round to the same one.
            latest = start + math.floor((burst.latest - burst.start) * rate_hz)
        self._number += 1
        self._bursts[self._number] = burst
        return BurstOrder(
            self._number, start, latest, self._late, burst.mcs, burst.pdus, burst.n_timed
        )

    def take(self, report: BurstReport) -> Burst | None:
        """The burst that a report is about; None if it was taken before."""
        self._late += report.outcome is Outcome.LATE
        return self._bursts.pop(report.number, None)

    def take_all(self) -> list[Burst]:
        """All bursts on the way, which then are no more."""
        bursts = list(self._bursts.values())
        self._bursts.clear()
        return bursts
