"""Pictures of a team that relays: delivery and delay by class, and hops, over time."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap

from sdrlinkd.lab.over_time import BINS, as_array
from sdrlinkd.lab.report import LabReport, PairResult
from sdrlinkd.pictures import legend_beside, looks

SHADES = ("#DDEEFF", "#86BCE0", "#2F7FB8", "#0B3C6F")
"""One hop, two, three, and more."""


def draw_classes(delivery: Axes, delay: Axes, report: LabReport) -> None:
    """The PDR of each class, and its delay: the median, and dotted the 99th percentile."""
    edges = np.linspace(0, report.duration_s, BINS + 1)
    middle = (edges[:-1] + edges[1:]) / 2
    styles = looks([each.qos for each in report.classes])
    for each in report.classes:
        look = styles[each.qos]
        delivery.plot(middle, as_array(each.pdr), color=look.color, linestyle=look.line,
                      marker=look.marker, markersize=3, label=each.qos)  # fmt: skip
        delay.plot(middle, as_array(each.p50_ms), color=look.color, linestyle=look.line,
                   marker=look.marker, markersize=3, label=f"{each.qos}, p50")  # fmt: skip
        delay.plot(middle, as_array(each.p99_ms), color=look.color, linestyle=":",
                   label=f"{each.qos}, p99")  # fmt: skip
    delivery.set(ylabel="PDR by class", ylim=(-0.03, 1.05))
    delay.set(ylabel="delay in ms", yscale="log")
    legend_beside(delivery, "class")
    legend_beside(delay)


def draw_hops(axes: Axes, pairs: Sequence[PairResult], duration_s: float) -> None:
    """The hops that messages took, a row for each pair; white: nothing came."""
    hops = np.array([as_array(pair.hops) for pair in pairs])
    shown = axes.imshow(
        np.clip(np.round(hops), 1, len(SHADES)), aspect="auto", interpolation="nearest",
        cmap=ListedColormap(SHADES), vmin=0.5, vmax=len(SHADES) + 0.5,
        extent=(0, duration_s, len(pairs) - 0.5, -0.5),
    )  # fmt: skip
    axes.set_yticks(
        range(len(pairs)), [f"{pair.sender} → {pair.receiver}" for pair in pairs], fontsize=8
    )
    axes.grid(visible=False)
    axes.set_ylabel("route")
    figure = axes.get_figure()
    if figure is not None:
        bar = figure.colorbar(shown, ax=axes, ticks=range(1, len(SHADES) + 1), pad=0.01)
        bar.ax.set_yticklabels(["1", "2", "3", "4 +"], fontsize=8)
        bar.set_label("hops", fontsize=8)
