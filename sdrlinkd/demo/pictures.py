"""Draws the paper's Figures 6 and 7 for our runs."""

from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sdrlinkd.demo.trace import Path2D, Trace, latencies_s

SENT_MARK_EVERY = 50


def latency_cdf(runs: dict[str, Trace], path: Path, caption: str) -> None:
    """Draw Figure 6: the distribution of the end-to-end latency, with one line per run."""
    figure, axes = plt.subplots(figsize=(6.4, 4.0), layout="constrained")
    for name, trace in runs.items():
        ordered = latencies_s(trace.all_pairs()) * 1e3
        if len(ordered):
            share = np.arange(1, len(ordered) + 1) / len(ordered)
            median = float(np.median(ordered))
            axes.step(ordered, share, where="post", label=f"{name} (median {median:.2f} ms)")
    axes.set_xscale("log")
    axes.set(xlabel="end-to-end latency in ms", ylabel="share of messages", ylim=(0, 1.02))
    axes.grid(visible=True, which="both", alpha=0.25)
    axes.set_title("Latency, publish to reception")
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="lower right")
    _save(figure, path, caption)


def paths(runs: dict[str, Trace], path: Path, caption: str) -> None:
    """Draw Figure 7: paths sent and received, a column per run and a row per odometry topic."""
    topics = next(iter(runs.values())).odometry_topics()
    n_rows = max(1, len(topics))
    figure, panels = plt.subplots(
        n_rows, len(runs), figsize=(4.4 * len(runs), 4.2 * n_rows),
        layout="constrained", squeeze=False,
    )  # fmt: skip
    for column, (run, trace) in zip(panels.T, runs.items(), strict=True):
        pairs, _ = trace.matches()
        for axes, name in zip(column, topics, strict=False):
            sent = trace.path(trace.sent[name])
            got = trace.path([sample for _, sample in pairs.get(name, [])])
            _draw_path(axes, sent, got)
            axes.set_title(f"{run}: /{name}")
        if not topics:
            column[0].text(0.5, 0.5, "no odometry was sent", ha="center", va="center")
            column[0].set_axis_off()
    _save(figure, path, caption)


def _draw_path(axes: Axes, sent: Path2D, got: Path2D) -> None:
    axes.plot(*sent.T, color="tab:blue", linewidth=1.2, label=f"sent ({len(sent)})")
    axes.plot(*sent[::SENT_MARK_EVERY].T, "o", color="tab:blue", markersize=5)
    axes.plot(*got.T, ".", color="tab:red", markersize=2.5, label=f"received ({len(got)})")
    axes.set(xlabel="x in m", ylabel="y in m", aspect="equal")
    axes.set_adjustable("datalim")
    axes.grid(visible=True, alpha=0.25)
    axes.legend(loc="best")


def _save(figure: Figure, path: Path, caption: str) -> None:
    figure.text(0.01, -0.03, caption, fontsize=7, color="0.35", va="top")
    figure.savefig(path, dpi=120, bbox_inches="tight")
    plt.close(figure)
