"""Draws the paper's Figures 6 and 7 for our runs."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from sdrlinkd.colors import COLORS
from sdrlinkd.demo.trace import Path2D, Trace, latencies_s
from sdrlinkd.pictures import OURS, legend_beside, looks, make_figure, save

SENT_MARK_EVERY = 50


def latency_cdf(runs: dict[str, Trace], path: Path, caption: str) -> None:
    """Draw Figure 6: the distribution of the end-to-end latency, with one line per run."""
    figure, panels = make_figure(size=(7.2, 3.8))
    axes = panels[0, 0]
    for (name, trace), look in zip(runs.items(), looks(runs).values(), strict=True):
        ordered = latencies_s(trace.all_pairs()) * 1e3
        if len(ordered):
            share = np.arange(1, len(ordered) + 1) / len(ordered)
            median = float(np.median(ordered))
            axes.step(
                ordered, share, where="post", color=look.color, linestyle=look.line,
                label=f"{name}\nmedian {median:.2f} ms",
            )  # fmt: skip
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter("{x:g}")
    axes.set(xlabel="latency from publisher to subscriber in ms", ylabel="share of messages",
             ylim=(0, 1.02))  # fmt: skip
    legend_beside(axes)
    save(figure, path, caption)


def paths(runs: dict[str, Trace], path: Path, caption: str) -> None:
    """Draw Figure 7: paths sent and received, a column per run and a row per odometry topic."""
    topics = next(iter(runs.values())).odometry_topics()
    n_rows = max(1, len(topics))
    figure, panels = make_figure(n_rows, len(runs), (4.2 * len(runs), 4.2 * n_rows))
    for column, (run, trace) in zip(panels.T, runs.items(), strict=True):
        pairs, _ = trace.matches()
        for axes, name in zip(column, topics, strict=False):
            sent = trace.path(trace.sent[name])
            got = trace.path([sample for _, sample in pairs.get(name, [])])
            _draw_path(axes, sent, got)
            axes.set_title(f"{run}: /{name}, {len(sent)} sent, {len(got)} received", fontsize=9)
        if not topics:
            column[0].text(0.5, 0.5, "no odometry was sent", ha="center", va="center")
            column[0].set_axis_off()
    save(figure, path, f"{caption}; line: sent; circles: every {SENT_MARK_EVERY}th sent; "
         "dots: received")  # fmt: skip


def _draw_path(axes: Axes, sent: Path2D, got: Path2D) -> None:
    axes.plot(*sent.T, color=COLORS[7], linewidth=3.0)
    axes.plot(*sent[::SENT_MARK_EVERY].T, "o", color=COLORS[7], markerfacecolor="none")
    axes.plot(*got.T, ".", color=OURS, markersize=2.0)
    axes.set(xlabel="x in m", ylabel="y in m", aspect="equal")
    axes.set_adjustable("datalim")
