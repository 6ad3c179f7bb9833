"""Time series of a link's figures over the last minutes, from snapshots."""

from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

from sdrlinkd.cli.screens import is_idle, sparkline
from sdrlinkd.reports import Snapshot

PERIOD_S = 1.0
SPAN = 240
"""Number of snapshots that are kept, i.e. 4 minutes."""


class Series(NamedTuple):
    """A figure over time, drawn between `low` and `high`; `high` 0: up to its maximum."""

    name: str
    low: float
    high: float
    values: deque[float | None]

    def line(self, width: int) -> str:
        """The series in `width` characters: name, last value, and means as small bars."""
        last = self.values[-1] if self.values else None
        told = "–" if last is None else f"{last:.1f}" if abs(last) < 1000 else f"{last:.0f}"
        room = width - 15
        means = _means(self.values, room)
        high = self.high or max([1.0, *(each for each in means if each is not None)])
        return f"{self.name:<7}{told:>7} {sparkline(means, self.low, high, room)}"


class History:
    """Time series of the last snapshots' figures; None marks a moment without the daemon."""

    def __init__(self) -> None:
        self._before: tuple[int, int] | None = None
        self.series = [
            Series(name, low, high, deque(maxlen=SPAN))
            for name, low, high in (
                ("SNR dB", 0.0, 30.0), ("PDR %", 0.0, 100.0), ("air %", 0.0, 100.0),
                ("queue", 0.0, 0.0), ("age ms", 0.0, 0.0),
            )
        ]  # fmt: skip

    def add(self, snapshot: Snapshot | None) -> None:
        """Add the figures of a snapshot; None: the daemon is away."""
        values = [None] * len(self.series) if snapshot is None else self._figures(snapshot)
        for series, value in zip(self.series, values, strict=True):
            series.values.append(value)
        if snapshot is None:
            self._before = None

    def _figures(self, snapshot: Snapshot) -> list[float | None]:
        """The worst SNR, recent deliveries, the channel's use, the queue and the latest age."""
        link = snapshot.link
        snr = [each.snr_db for each in link.neighbors if each.snr_db is not None]
        ages = [
            each.age_ms_last
            for each in link.received
            if each.age_ms_last is not None and not is_idle(each)
        ]
        return [
            min(snr, default=None),
            self._pdr(snapshot),
            link.air_sent_pct + link.air_heard_pct,
            float(link.tx.queued),
            max(ages, default=None),
        ]

    def _pdr(self, snapshot: Snapshot) -> float | None:
        """Share in % of recent messages that were delivered; None if there were none."""
        rx = snapshot.link.rx
        now = (rx.delivered, sum(rx.dropped.values()))
        before, self._before = self._before, now
        if before is None:
            return None
        arrived, lost = (later - earlier for later, earlier in zip(now, before, strict=True))
        # Smaller counters mean that another daemon answers now.
        if arrived < 0 or lost < 0 or not arrived + lost:
            return None
        return 100.0 * arrived / (arrived + lost)


def _means(values: Sequence[float | None], room: int) -> list[float | None]:
    """At most `room` means over equal spans of time, the last one up to now."""
    each = -(-SPAN // max(1, room))
    told: list[float | None] = []
    given = list(values)
    for end in range(len(given), 0, -each):
        part = [value for value in given[max(0, end - each) : end] if value is not None]
        told.append(sum(part) / len(part) if part else None)
    return told[:room][::-1]
