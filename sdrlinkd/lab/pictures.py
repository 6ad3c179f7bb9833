"""Pictures of a run: what each robot received from each other over time, and the MCS used."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogFormatter

from phy import MCS_TABLE
from sdrlinkd.colors import COLORS
from sdrlinkd.lab.report import LabReport
from sdrlinkd.lab.scenario import Scenario
from sdrlinkd.lab.team_pictures import draw_classes, draw_hops
from sdrlinkd.pictures import OURS, QUIET, legend_beside, looks, make_figure, save

MOST_NAMED = 12
"""More series than that are drawn without names."""


def draw(report: LabReport, scenario: Scenario, path: Path, caption: str) -> None:
    """Draw the PDR in each tenth of the run, latencies, and the MCS between each two robots."""
    distances = _distances(report, scenario)
    adaptive = any(robot.mcs_changes for robot in report.robots)
    relayed = [pair for pair in report.pairs if pair.hops]
    heights = [2.4, *([1.8] if distances else []), *([2.4] if adaptive else [])]
    if relayed:
        heights += [1.8, 2.2, 0.8 + 0.18 * max(4, min(len(relayed), 60))]
    heights.append(0.9 + 0.2 * max(3, min(len(report.pairs), 60)))
    figure, panels = make_figure(
        len(heights), 1, (8.0, sum(heights)), height_ratios=heights
    )  # fmt: skip
    over_time = list(panels[:-1, 0])
    _pdr(over_time[0], report)
    if distances:
        _draw_distances(over_time[1], distances)
    if adaptive:
        _mcs(over_time[1 + bool(distances)], report)
    if relayed:
        draw_classes(over_time[-3], over_time[-2], report)
        draw_hops(over_time[-1], relayed, report.duration_s)
    for axes in over_time:
        axes.set_xlim(0, report.duration_s)
    over_time[-1].set_xlabel("time in s")
    _latency(panels[-1, 0], report)
    figure.suptitle(report.title or report.scenario, parse_math=False)
    save(figure, path, caption)


def _pdr(axes: Axes, report: LabReport) -> None:
    edges = np.linspace(0, report.duration_s, 11)
    names = [f"{pair.sender} → {pair.receiver}" for pair in report.pairs]
    for pair, name, look in zip(report.pairs, names, looks(names).values(), strict=True):
        shares = [np.nan if share is None else share for share in pair.pdr_tenths]
        axes.plot((edges[:-1] + edges[1:]) / 2, shares, color=look.color, linestyle=look.line,
                  marker=look.marker, markersize=4, label=name)  # fmt: skip
    axes.set(ylabel="PDR, by time of sending", ylim=(-0.03, 1.05))
    if len(report.pairs) <= MOST_NAMED:
        legend_beside(axes, "from → to")


def _distances(report: LabReport, scenario: Scenario) -> dict[str, tuple[list[float], list[float]]]:
    """Distance in m over time in s of each two robots of which one moves."""
    tracks = scenario.tracks
    moving = {each.id for each in scenario.robot if len(each.path) > 1}
    times = list(np.linspace(0, report.duration_s, 200))
    found = {}
    for one in sorted(tracks):
        for other in sorted(tracks):
            if one < other and {one, other} & moving:
                places = [(tracks[one].at(t), tracks[other].at(t)) for t in times]
                apart = [float(np.hypot(a[0] - b[0], a[1] - b[1])) for a, b in places]
                found[f"{one} – {other}"] = (times, apart)
    return found


def _draw_distances(axes: Axes, distances: dict[str, tuple[list[float], list[float]]]) -> None:
    for (name, (times, apart)), look in zip(
        distances.items(), looks(distances).values(), strict=True
    ):
        axes.plot(times, apart, color=look.color, linestyle=look.line, label=name)
    axes.set(ylabel="distance in m", ylim=(0, None))
    if 1 < len(distances) <= MOST_NAMED:
        legend_beside(axes, "robots")


def _mcs(axes: Axes, report: LabReport) -> None:
    series = {
        f"{robot.id} → {node}": [(at, mcs) for at, other, mcs in robot.mcs_changes if other == node]
        for robot in report.robots
        for node in sorted({node for _, node, _ in robot.mcs_changes})
    }
    for (name, changes), look in zip(series.items(), looks(series).values(), strict=True):
        times = [at for at, _ in changes] + [report.duration_s]
        steps = [mcs for _, mcs in changes] + [changes[-1][1]]
        axes.step(times, steps, where="post", color=look.color, linestyle=look.line, label=name)
    used = [mcs for changes in series.values() for _, mcs in changes]
    shown = range(min(used), max(used) + 1)
    axes.set_yticks(shown, [MCS_TABLE[mcs].name for mcs in shown], fontsize=8)
    axes.set_ylabel("MCS in use")
    if len(series) <= MOST_NAMED:
        legend_beside(axes, "from → to")


def _latency(axes: Axes, report: LabReport) -> None:
    """A line for each pair, from its median to its 99th percentile."""
    pairs = [pair for pair in report.pairs if pair.latency_ms]
    at = np.arange(len(pairs))
    p50, p90, p99 = ([pair.latency_ms[name] for pair in pairs] for name in ("p50", "p90", "p99"))
    axes.hlines(at, p50, p99, color=QUIET, linewidth=1.5)
    for values, marker, color, name in (
        (p50, "o", OURS, "p50"), (p90, "|", OURS, "p90"), (p99, "D", COLORS[1], "p99"),
    ):  # fmt: skip
        axes.plot(values, at, marker, color=color, label=name, markersize=7 if marker == "|" else 5)
    axes.set_yticks(at, [f"{pair.sender} → {pair.receiver}" for pair in pairs], fontsize=8)
    axes.set_ylim(len(pairs) - 0.4, -0.6)
    axes.set_xscale("log")
    if not pairs:
        axes.set_xlim(1, 1000)
    for ticks in (axes.xaxis.set_major_formatter, axes.xaxis.set_minor_formatter):
        ticks(LogFormatter(labelOnlyBase=False, minor_thresholds=(2, 0.5)))
    axes.set_xlabel("latency from publisher to subscriber in ms")
    legend_beside(axes)
