"""Latency statistics of one topic: ages, jitter, and the parts of the delay."""

from collections import deque
from statistics import fmean, pstdev
from typing import NamedTuple

from hdrh.histogram import HdrHistogram

RECENT = 256
LONGEST_US = 600_000_000
DIGITS = 2
PERCENTILES = (50.0, 90.0, 99.0, 99.9)


class Parts(NamedTuple):
    """The parts of a message's age, in s.

    `wait_s` is the wait at the source and at relays, `reassembly_s` the time between the first and
    the last fragment, `air_s` the time of the last fragment on the air, and `handover_s` the time
    for demodulation and handover.
    """

    wait_s: float
    reassembly_s: float
    air_s: float
    handover_s: float


class Latency:
    """The latest ages with their parts, and a histogram of all ages."""

    __slots__ = ("_came_at", "_histogram", "_intervals", "_parts")

    def __init__(self) -> None:
        self._parts: deque[Parts] = deque(maxlen=RECENT)
        self._intervals: deque[float] = deque(maxlen=RECENT)
        self._came_at: float | None = None
        self._histogram = HdrHistogram(1, LONGEST_US, DIGITS)

    def add(self, parts: Parts, now: float) -> float:
        """Add a message handed over at `now`; returns its age in s."""
        age_s = sum(parts)
        self._parts.append(parts)
        if self._came_at is not None:
            self._intervals.append(now - self._came_at)
        self._came_at = now
        self._histogram.record_value(min(max(1, round(1e6 * age_s)), LONGEST_US))
        return age_s

    def last_ms(self) -> float | None:
        """Age of the latest message in ms; None before the first."""
        return sum(self._parts[-1]) * 1e3 if self._parts else None

    def quantile_ms(self, q: float) -> float | None:
        """The `q` quantile (nearest rank) of the recent ages in ms; None before the first."""
        if not self._parts:
            return None
        ordered = sorted(map(sum, self._parts))
        return ordered[min(len(ordered) - 1, int(q * len(ordered)))] * 1e3

    def parts(self) -> Parts:
        """Means of the parts over the recent messages; 0 before the first."""
        if not self._parts:
            return Parts(0.0, 0.0, 0.0, 0.0)
        return Parts(*map(fmean, zip(*self._parts, strict=True)))

    def period_ms(self) -> tuple[float, float] | None:
        """(mean, standard deviation) in ms of the time between recent messages; None: too few.

        The standard deviation is the Pound paper's Jd.
        """
        if not self._intervals:
            return None
        return 1e3 * fmean(self._intervals), 1e3 * pstdev(self._intervals)

    def percentiles_ms(self) -> dict[str, float]:
        """Percentiles in ms of all ages since the start, within 1 %, and their maximum as `max`."""
        found = self._histogram.get_percentile_to_value_dict([*PERCENTILES, 100.0])
        told = {f"{p:g}": 1e-3 * found[p] for p in PERCENTILES}
        return {**told, "max": 1e-3 * found[100.0]}
