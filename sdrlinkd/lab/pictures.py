"""Pictures of a run: what each robot received from each other over time, and the MCS used."""

from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.ticker import LogFormatter

from phy import MCS_TABLE
from sdrlinkd.lab.report import LabReport


def draw(report: LabReport, path: Path, caption: str) -> None:
    """Draw the PDR in each tenth of the run, latencies, and the MCS between each two robots."""
    adaptive = any(robot.mcs_changes for robot in report.robots)
    figure, panels = plt.subplots(
        2 + adaptive, 1, figsize=(7.2, 6.4 + 2.2 * adaptive), layout="constrained"
    )
    _pdr(panels[0], report)
    _latency(panels[1], report)
    if adaptive:
        _mcs(panels[2], report)
    figure.suptitle(report.title or report.scenario, parse_math=False)
    figure.text(0.01, -0.02, caption, fontsize=7, color="0.35", va="top", parse_math=False)
    figure.savefig(path, dpi=120, bbox_inches="tight")
    plt.close(figure)


def _pdr(axes: Axes, report: LabReport) -> None:
    edges = np.linspace(0, report.duration_s, 11)
    middles = (edges[:-1] + edges[1:]) / 2
    for pair in report.pairs:
        shares = [np.nan if share is None else share for share in pair.pdr_tenths]
        axes.plot(middles, shares, "o-", markersize=3, label=f"{pair.sender} → {pair.receiver}")
    axes.set(xlabel="sent at, in s", ylabel="PDR", ylim=(-0.03, 1.05))
    axes.grid(visible=True, alpha=0.25)
    if 0 < len(report.pairs) <= 12:
        axes.legend(loc="lower left", ncols=3, fontsize=8)


def _latency(axes: Axes, report: LabReport) -> None:
    pairs = [pair for pair in report.pairs if pair.latency_ms]
    at = np.arange(len(pairs))
    for name, color in (("p50", "tab:blue"), ("p90", "tab:cyan"), ("p99", "tab:orange")):
        axes.plot(at, [pair.latency_ms[name] for pair in pairs], "o", color=color, label=name)
    labels = [f"{pair.sender} → {pair.receiver}" for pair in pairs]
    axes.set_xticks(at, labels, rotation=60 if len(pairs) > 6 else 0, fontsize=8)
    axes.set_yscale("log")
    for ticks in (axes.yaxis.set_major_formatter, axes.yaxis.set_minor_formatter):
        ticks(LogFormatter(labelOnlyBase=False, minor_thresholds=(2, 0.5)))
    axes.set(ylabel="publish to reception, in ms", xlim=(-0.5, max(1, len(pairs)) - 0.5))
    axes.grid(visible=True, which="both", alpha=0.25)
    if pairs:
        axes.legend(loc="upper center", ncols=3, fontsize=8)


def _mcs(axes: Axes, report: LabReport) -> None:
    for robot in report.robots:
        for node in sorted({node for _, node, _ in robot.mcs_changes}):
            changes = [(at, mcs) for at, other, mcs in robot.mcs_changes if other == node]
            times = [at for at, _ in changes] + [report.duration_s]
            steps = [mcs for _, mcs in changes] + [changes[-1][1]]
            axes.step(times, steps, where="post", label=f"robot {robot.id} for {node}")
    axes.set_yticks(range(len(MCS_TABLE)), [mcs.name for mcs in MCS_TABLE], fontsize=8)
    axes.set(xlabel="time in s", xlim=(0, report.duration_s))
    axes.grid(visible=True, alpha=0.25)
    axes.legend(loc="upper center", fontsize=8)
