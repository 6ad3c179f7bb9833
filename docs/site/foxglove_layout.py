"""Writes the layout of panels for Foxglove, etc/foxglove/sdrlink.json: `make reference`."""

import json
import sys
from pathlib import Path
from typing import Literal

from foxglove import layouts as fl

FILE = Path(__file__).parents[2] / "etc/foxglove/sdrlink.json"
STATUS, BRIDGE = "/sdrlink/status", "/sdrlink/bridge"
RED, AMBER, GREEN = "#e74c3c", "#f39c12", "#2ecc71"
VERDICTS = {"OK": GREEN, "DEGRADED": AMBER, "DOWN": RED}
WINDOW_S = 120.0


def plot(title: str, axis: str, *series: tuple[str, str]) -> fl.PlotPanel:
    """Curves of (path below the status, label) over the last two minutes.

    A path over a list gives a curve for each of its items.
    """
    paths = [
        fl.PlotSeries(
            value=f"{STATUS}.{path}", label=label, enabled=True,
            array_expansion="byIndex" if "[:]" in path else "none",
        )
        for path, label in series
    ]  # fmt: skip
    config = fl.PlotConfig(
        paths=paths, y_axis_label=axis, following_view_width=WINDOW_S,
        time_window_mode="sliding", show_legend=True, legend_display="floating", is_synced=True,
    )  # fmt: skip
    return fl.PlotPanel(title=title, config=config)


def table(title: str, path: str) -> fl.TablePanel:
    """A table of a list of the status."""
    return fl.TablePanel(title=title, config=fl.TableConfig(topic_path=f"{STATUS}.{path}"))


def split(direction: Literal["row", "column"], *parts: tuple[float, fl.Content]) -> fl.Content:
    """Panels beside or above one another, each with its share."""
    return fl.SplitContainer(
        direction=direction,
        items=[fl.SplitItem(proportion=share, content=part) for share, part in parts],
    )


def verdict() -> fl.Content:
    """The verdict now and over time, and its reasons."""
    rules = [
        fl.IndicatorRule(raw_value=word, operator="=", color=color, label=word)
        for word, color in VERDICTS.items()
    ]
    now = fl.IndicatorPanel(
        title="Verdict",
        config=fl.IndicatorConfig(
            path=f"{STATUS}.verdict.level", style="background", rules=rules,
            fallback_color=AMBER, fallback_label="no daemon",
        ),
    )  # fmt: skip
    states = [
        fl.StateTransitionsDiscreteCustomState(value=word, label=word, color=color)
        for word, color in VERDICTS.items()
    ]
    series = fl.StateTransitionsSeries(
        value=f"{STATUS}.verdict.level", label="verdict", enabled=True,
        custom_states=fl.StateTransitionsDiscreteCustomStates(states=states),
    )  # fmt: skip
    over_time = fl.StateTransitionsPanel(
        title="Verdict over time", config=fl.StateTransitionsConfig(paths=[series], is_synced=True)
    )
    reasons = fl.RawMessagesPanel(
        title="Reasons",
        config=fl.RawMessagesConfig(topic_path=f"{STATUS}.verdict", expansion="all"),
    )
    return split("row", (1, now), (2, over_time), (2, reasons))


def layout() -> fl.Layout:
    """The whole layout: places on the left, the link on the right."""
    scene = fl.ThreeDeePanel(
        title="Robots",
        config=fl.ThreeDeeConfig(
            follow_tf="map",
            topics={"/sdrlink/robots": fl.BaseRendererSceneUpdateTopicSettings(visible=True)},
        ),
    )
    earth = fl.MapPanel(title="On the map", config=fl.MapConfig(layer="map"))
    neighbors = "link.neighbors[:]"
    link = split(
        "column",
        (2, table("Neighbors", neighbors)),
        (3, plot("SNR", "dB", (f"{neighbors}.snr_db", "here"),
                 (f"{neighbors}.snr_there_db", "there"))),
        (3, plot("Loss", "share of PDUs", (f"{neighbors}.per_lately", "here"),
                 (f"{neighbors}.per_there", "there"))),
    )  # fmt: skip
    topics = split(
        "column",
        (2, table("Received topics", "link.received[:]")),
        (3, plot("Age, median and p99", "ms", ("link.received[:].age_ms_p50", "p50"),
                 ("link.received[:].age_ms_p99", "p99"))),
        (3, plot("PDR", "share of messages", ("link.received[:].pdr", "PDR"))),
    )  # fmt: skip
    queues = split(
        "column",
        (2, table("Topics sent", "link.topics[:]")),
        (3, plot("Queue", "messages", *(
            (f"link.tx.queued_by_class.{each}", each)
            for each in ("urgent", "latency", "default", "bulk")))),
        (3, plot("Air", "%", ("link.air_sent_pct", "sent"), ("link.air_heard_pct", "heard"))),
    )  # fmt: skip
    bridge = fl.RawMessagesPanel(title="Bridge", config=fl.RawMessagesConfig(topic_path=BRIDGE))
    tabs = {"Link": link, "Topics": topics, "Queue and air": queues, "Bridge": bridge}
    right = split(
        "column",
        (1, verdict()),
        (5, fl.TabContainer(
            tabs=[fl.TabItem(title=name, content=each) for name, each in tabs.items()])),
    )  # fmt: skip
    return fl.Layout(content=split("row", (1, split("column", (3, scene), (2, earth))), (1, right)))


def text() -> str:
    """The layout as the text of its file."""
    return json.dumps(json.loads(layout().to_json()), indent=1) + "\n"


def main() -> int:
    """Write it."""
    FILE.parent.mkdir(exist_ok=True)
    FILE.write_text(text())
    sys.stdout.write(f"wrote {FILE.name}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
