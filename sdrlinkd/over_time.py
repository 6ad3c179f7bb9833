"""The figures of a daemon that pictures over time are drawn of."""

from collections.abc import Iterator
from typing import Any

from sdrlinkd.client import QOS
from sdrlinkd.reports import Snapshot


def figures_of(
    snapshot: Snapshot | None, before: Snapshot | None
) -> dict[str, dict[str, float | None]]:
    """The figures of a report, by picture and name; empty for None.

    `before` is an earlier report, from which what happened in between is counted; None: none, or
    the daemon has started anew.
    """
    if snapshot is None:
        return {name: {} for name in FIGURES}
    return {name: dict(figures(snapshot, before)) for name, figures in FIGURES.items()}


def is_later(snapshot: Snapshot, before: Snapshot) -> bool:
    """Whether a report is of the same start of the daemon as one before it."""
    return snapshot.uptime_s > before.uptime_s


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
    for name in QOS:
        spent_s = snapshot.link.airtime_by_class_s.get(name, 0.0)
        spent_s -= before.link.airtime_by_class_s.get(name, 0.0)
        yield name, 100 * max(0.0, spent_s) / span_s
    control_s = snapshot.link.control_airtime_s - before.link.control_airtime_s
    yield "control", 100 * max(0.0, control_s) / span_s


def _queue(snapshot: Snapshot, _: Snapshot | None) -> Figures:
    for name in QOS:
        yield name, snapshot.link.tx.queued_by_class.get(name, 0)


def _wait(snapshot: Snapshot, _: Snapshot | None) -> Figures:
    longest: dict[str, float] = {}
    for each in snapshot.link.topics:
        if each.queue_ms is not None and each.queued:
            longest[each.qos] = max(longest.get(each.qos, 0.0), each.queue_ms)
    for name in QOS:
        yield name, longest.get(name)


def _drops(snapshot: Snapshot, before: Snapshot | None) -> Figures:
    if before is None:
        return
    span_s = snapshot.uptime_s - before.uptime_s
    for now, then in ((snapshot.link.tx, before.link.tx), (snapshot.link.rx, before.link.rx)):
        for name, n in now.dropped.items():
            if n:
                yield name, max(0, n - then.dropped.get(name, 0)) / span_s


def _age(snapshot: Snapshot, _: Snapshot | None) -> Figures:
    for each in snapshot.link.received:
        yield f"robot {each.src} {each.name}", each.age_ms_p99


def _clock(snapshot: Snapshot, _: Snapshot | None) -> Figures:
    for each in _others(snapshot):
        if each.clock is not None:
            yield f"robot {each.src}", each.clock.bound_us


def _others(snapshot: Snapshot) -> list[Any]:
    return [each for each in snapshot.link.neighbors if not each.is_self]


def _pct(share: float | None) -> float | None:
    return None if share is None else 100 * share


FIGURES = {
    "snr": _snr, "loss": _loss, "air": _air, "queue": _queue, "wait": _wait, "drops": _drops,
    "clock": _clock, "age": _age,
}  # fmt: skip
"""By the name of the picture."""
