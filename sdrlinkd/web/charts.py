"""The pictures of a station's last minutes, as options of Apache ECharts."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from sdrlinkd.colors import COLORS
from sdrlinkd.reports import Snapshot
from sdrlinkd.web.history import History

DASHES = ("solid", "dashed", "dotted")
PARTS = ("queue", "access", "again", "rest of the wait", "reassembly", "air", "handover")
"""The parts of a message's age, in their order."""
MOST_BARS = 16


class Picture(NamedTuple):
    """A picture over time; `most` is the top of its axis, if that is always the same."""

    title: str
    unit: str
    most: float | None = None
    is_stacked: bool = False


PICTURES = {
    "snr": Picture("SNR", "dB"),
    "loss": Picture("PDUs lost", "%", 100),
    "air": Picture("Use of the air", "%", 100, is_stacked=True),
    "queue": Picture("Messages queued", "", is_stacked=True),
    "wait": Picture("Wait in the queue", "ms"),
    "drops": Picture("Messages dropped", "/s"),
    "clock": Picture("Error of clocks at most", "µs"),
    "age": Picture("Age of messages, p99", "ms"),
}


def empty_chart(picture: Picture) -> dict[str, Any]:
    """The options of a picture before anything is known."""
    unit = f" in {picture.unit}" if picture.unit else ""
    return {
        "title": {"text": f"{picture.title}{unit}", "left": 8, "top": 4, "textStyle": _TEXT},
        "color": list(COLORS),
        "animation": False,
        "grid": {"left": 48, "right": 16, "top": 36, "bottom": 64},
        "legend": {"type": "scroll", "bottom": 30, "textStyle": {"fontSize": 13}},
        "tooltip": {"trigger": "axis", "renderMode": "richText", "confine": True},
        "xAxis": {"type": "time", "axisLabel": _LABEL, "splitLine": {"show": True}},
        "yAxis": {"type": "value", "min": 0 if picture.unit != "dB" else None,
                  "max": picture.most, "axisLabel": _LABEL},
        "dataZoom": [{"type": "inside"}, {"type": "slider", "height": 18, "bottom": 6}],
        "series": [],
    }  # fmt: skip


def series(name: str, history: History) -> list[dict[str, Any]]:
    """The lines of a picture, each with (ms since 1970, value) for each second."""
    picture = PICTURES[name]
    times = [round(1000 * at) for at in history.times]
    return [
        {
            "type": "line", "id": line, "name": line, "showSymbol": False, "connectNulls": False,
            "lineStyle": {"width": 2, "type": DASHES[i // len(COLORS) % len(DASHES)]},
            "data": list(zip(times, (_rounded(each) for each in values), strict=True)),
        }
        | ({"stack": "all", "areaStyle": {"opacity": 0.35}} if picture.is_stacked else {})
        for i, (line, values) in enumerate(history.lines[name].items())
    ]  # fmt: skip


def newest(history: History, since_ms: int) -> list[list[Any]]:
    """What has come since: for each time, (ms since 1970, values by picture and line)."""
    found: list[list[Any]] = []
    for back in range(1, len(history.times) + 1):
        at_ms = round(1000 * history.times[-back])
        if at_ms <= since_ms:
            break
        values = {
            name: {line: _rounded(values[-back]) for line, values in lines.items()}
            for name, lines in history.lines.items()
        }
        found.insert(0, [at_ms, values])
    return found


def empty_waterfall() -> dict[str, Any]:
    """The options of the picture of ages, before anything is known."""
    return {
        "title": {"text": "Age of messages in ms, by its parts", "left": 8, "top": 4,
                  "textStyle": _TEXT},
        "color": list(COLORS),
        "animation": False,
        "grid": {"left": 16, "right": 24, "top": 36, "bottom": 40, "containLabel": True},
        "legend": {"type": "scroll", "bottom": 4, "textStyle": {"fontSize": 13}},
        "tooltip": {"trigger": "axis", "axisPointer": {"type": "shadow"},
                    "renderMode": "richText", "confine": True},
        "xAxis": {"type": "value", "axisLabel": _LABEL},
        "yAxis": {"type": "category", "data": [], "axisLabel": _LABEL},
        "series": [],
    }  # fmt: skip


def waterfall(snapshot: Snapshot) -> dict[str, Any]:
    """What changes in the picture of ages: the topics, and a bar for each part."""
    rows = [each for each in snapshot.link.received if each.latency is not None][:MOST_BARS]
    names = [f"robot {each.src} {each.name}" for each in rows]
    parts: Mapping[str, Sequence[float]] = {name: [] for name in PARTS}
    columns = [_parts(each.latency) for each in rows if each.latency is not None]
    parts = {name: [column[i] for column in columns] for i, name in enumerate(PARTS)}
    return {
        "yAxis": {"data": names[::-1]},
        "series": [
            {"type": "bar", "id": name, "name": name, "stack": "age", "data": [*values][::-1]}
            for name, values in parts.items()
        ],
    }


def _parts(latency: Any) -> list[float]:  # noqa: ANN401
    waits = [latency.queue_ms or 0.0, latency.access_ms or 0.0, latency.again_ms or 0.0]
    rest = max(0.0, latency.wait_ms - sum(waits))
    after = [latency.reassembly_ms, max(0.0, latency.air_ms), latency.handover_ms]
    return _all_rounded([*waits, rest, *after])


def _all_rounded(values: Iterable[float]) -> list[float]:
    return [round(max(0.0, each), 2) for each in values]


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 2)


_TEXT = {"fontSize": 15, "fontWeight": "bold"}
_LABEL = {"fontSize": 13}
