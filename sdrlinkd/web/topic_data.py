"""The rows of the tables of topics, and what can be set of a policy."""

from collections.abc import Sequence
from typing import Any, NamedTuple

from sdrlinkd.reports import ReceivedTopicReport, Snapshot, TopicReport

SENT = (
    ("name", "topic"), ("qos", "class"), ("priority", "priority"), ("rate", "a second"),
    ("bytes", "kB/s"), ("lifespan", "lifespan"), ("queued", "queued"), ("dropped", "dropped"),
)  # fmt: skip
RECEIVED = (
    ("robot", "robot"), ("name", "topic"), ("rate", "a second"), ("bytes", "kB/s"), ("pdr", "PDR"),
    ("p50", "age p50, ms"), ("p99", "age p99, ms"), ("lost", "lost"),
)  # fmt: skip
TEXTS = ("name", "qos", "dropped", "lost")
"""Columns on the left; the others are figures."""


class Slider(NamedTuple):
    """A number of a policy that can be set; the last of `values` may mean no limit."""

    key: str
    label: str
    values: Sequence[float]
    unit: str
    none: str = ""
    """What 0 means, if it is not just zero."""


SLIDERS = (
    Slider("priority", "Priority within the class", range(128), ""),
    Slider("lifespan_s", "Discard messages older than",
           (0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 1, 2, 5, 10, 30, 60, float("inf")), "s"),
    Slider("period_s", "Least time between messages",
           (0, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10), "s", "as they come"),
    Slider("depth", "Most messages queued", (0, 1, 2, 5, 10, 20, 50, 100), "", "no limit"),
    Slider("decimate", "Send one message in", (1, 2, 3, 4, 5, 10, 20, 50, 100), ""),
)  # fmt: skip


def columns(names: Sequence[tuple[str, str]]) -> list[dict[str, Any]]:
    """The columns of a table, as Quasar wants them."""
    return [
        {
            "name": name, "label": label, "field": name, "sortable": True,
            "align": "left" if name in TEXTS else "right",
        }
        for name, label in names
    ]  # fmt: skip


def sent_rows(snapshot: Snapshot) -> list[dict[str, Any]]:
    """The topics that the robot sends."""
    return [_sent(each) for each in snapshot.link.topics if each.subscribed or each.accepted]


def received_rows(snapshot: Snapshot) -> list[dict[str, Any]]:
    """The topics that come from other robots."""
    return [_received(each) for each in snapshot.link.received]


def shown(slider: Slider, value: float | None) -> str:
    """A value of a slider in words."""
    if value is None:
        return "as its class"
    if value == float("inf"):
        return "no limit"
    if not value and slider.none:
        return slider.none
    if slider.unit == "s" and 0 < value < 1:
        return f"{1000 * value:g} ms"
    return f"{value:g} {slider.unit}".strip()


def nearest(slider: Slider, value: float | None) -> int:
    """The step of a slider that is nearest to a value."""
    if value is None:
        return len(slider.values) - 1
    return min(range(len(slider.values)), key=lambda i: _distance(slider.values[i], value))


def _distance(one: float, other: float) -> float:
    return 0.0 if one == other else abs(one - other)


def _sent(topic: TopicReport) -> dict[str, Any]:
    return {
        "key": f"sent {topic.name}",
        "name": topic.name,
        "qos": topic.qos,
        "priority": topic.priority,
        "rate": round(topic.accepted_per_s, 1),
        "bytes": round(topic.accepted_bytes_per_s / 1000, 2),
        "lifespan": _lifespan(topic.lifespan_s),
        "queued": topic.queued,
        "dropped": _reasons(topic.dropped),
    }


def _received(topic: ReceivedTopicReport) -> dict[str, Any]:
    return {
        "key": f"received {topic.src} {topic.republished_as or topic.name}",
        "robot": topic.src,
        "name": topic.republished_as or topic.name,
        "rate": round(topic.delivered_per_s, 1),
        "bytes": round(topic.delivered_bytes_per_s / 1000, 2),
        "pdr": None if topic.pdr is None else round(topic.pdr, 4),
        "p50": None if topic.age_ms_p50 is None else round(topic.age_ms_p50, 1),
        "p99": None if topic.age_ms_p99 is None else round(topic.age_ms_p99, 1),
        "lost": _reasons(topic.dropped),
    }


def _lifespan(seconds: float | None) -> str:
    if seconds is None:
        return "no limit"
    return f"{1000 * seconds:g} ms" if seconds < 1 else f"{seconds:g} s"


def _reasons(dropped: dict[str, int]) -> str:
    return ", ".join(f"{name} {n}" for name, n in dropped.items() if n)
