"""What a station reported over the last minutes, once a second."""

from collections import deque
from collections.abc import Iterator, Mapping
from typing import Any

from sdrlinkd.reports import Snapshot

KEPT_S = 600
RECENT_S = 61
MOST_LINES = 40
"""Most lines in one picture; the robots and names that come first."""

CLASSES = ("urgent", "latency", "default", "bulk")


class History:
    """Lines over time: `lines[picture][name]` has a value for each time in `times`, or None."""

    def __init__(self) -> None:
        self.times: deque[float] = deque(maxlen=KEPT_S)
        """Seconds since 1970."""
        self.lines: dict[str, dict[str, deque[float | None]]] = {name: {} for name in PICTURES}
        self.recent: deque[Snapshot] = deque(maxlen=RECENT_S)
        """The reports of the last minute."""
        self._before: Snapshot | None = None

    def add(self, snapshot: Snapshot | None, at: float) -> None:
        """Add a second; None where there is no report."""
        self.times.append(at)
        for picture, values in _figures(snapshot, self._since(snapshot)).items():
            self._append(self.lines[picture], values)
        self._before = snapshot
        if snapshot is not None:
            self.recent.append(snapshot)

    def _since(self, snapshot: Snapshot | None) -> Snapshot | None:
        """The report before, unless the daemon started anew."""
        before = self._before
        if snapshot is None or before is None or snapshot.uptime_s <= before.uptime_s:
            return None
        return before

    def _append(
        self, lines: dict[str, deque[float | None]], values: Mapping[str, float | None]
    ) -> None:
        for name in values:
            if name not in lines and len(lines) < MOST_LINES:
                empty = [None] * (len(self.times) - 1)
                lines[name] = deque(empty, maxlen=KEPT_S)
        for name, line in lines.items():
            line.append(values.get(name))
        for name in [name for name, line in lines.items() if not any(v is not None for v in line)]:
            del lines[name]


def _figures(
    snapshot: Snapshot | None, before: Snapshot | None
) -> dict[str, dict[str, float | None]]:
    if snapshot is None:
        return {name: {} for name in PICTURES}
    return {name: dict(picture(snapshot, before)) for name, picture in PICTURES.items()}


Figures = Iterator[tuple[str, float | None]]


def _snr(snapshot: Snapshot, _: Snapshot | None) -> Figures:
    for each in _others(snapshot):
        yield f"robot {each.src} here", each.snr_db
        yield f"here at robot {each.src}", each.snr_there_db


def _loss(snapshot: Snapshot, _: Snapshot | None) -> Figures:
    for each in _others(snapshot):
        yield f"robot {each.src} here", _pct(each.per_lately)
        yield f"here at robot {each.src}", _pct(each.per_there)


def _air(snapshot: Snapshot, before: Snapshot | None) -> Figures:
    yield "heard", snapshot.link.air_heard_pct
    if before is None:
        return
    span_s = snapshot.uptime_s - before.uptime_s
    for name in CLASSES:
        spent_s = snapshot.link.airtime_by_class_s.get(name, 0.0)
        spent_s -= before.link.airtime_by_class_s.get(name, 0.0)
        yield name, 100 * max(0.0, spent_s) / span_s
    control_s = snapshot.link.control_airtime_s - before.link.control_airtime_s
    yield "control", 100 * max(0.0, control_s) / span_s


def _queue(snapshot: Snapshot, _: Snapshot | None) -> Figures:
    for name in CLASSES:
        yield name, snapshot.link.tx.queued_by_class.get(name, 0)


def _wait(snapshot: Snapshot, _: Snapshot | None) -> Figures:
    longest: dict[str, float] = {}
    for each in snapshot.link.topics:
        if each.queue_ms is not None and each.queued:
            longest[each.qos] = max(longest.get(each.qos, 0.0), each.queue_ms)
    for name in CLASSES:
        yield name, longest.get(name)


def _drops(snapshot: Snapshot, before: Snapshot | None) -> Figures:
    if before is None:
        return
    span_s = snapshot.uptime_s - before.uptime_s
    for now, then in ((snapshot.link.tx, before.link.tx), (snapshot.link.rx, before.link.rx)):
        for name, n in now.dropped.items():
            if n:
                yield name, max(0, n - then.dropped.get(name, 0)) / span_s


def _clock(snapshot: Snapshot, _: Snapshot | None) -> Figures:
    for each in _others(snapshot):
        if each.clock is not None:
            yield f"robot {each.src}", each.clock.bound_us


def _others(snapshot: Snapshot) -> list[Any]:
    return [each for each in snapshot.link.neighbors if not each.is_self]


def _pct(share: float | None) -> float | None:
    return None if share is None else 100 * share


PICTURES = {
    "snr": _snr, "loss": _loss, "air": _air, "queue": _queue, "wait": _wait, "drops": _drops,
    "clock": _clock,
}  # fmt: skip
"""What is kept, by the name of its picture."""
