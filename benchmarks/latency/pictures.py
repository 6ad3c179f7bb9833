"""Figures 6, 7, 9 and 10 of the Sensors 2023 paper, as an emulation; 11 as bars."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.stats import gaussian_kde

from benchmarks.kept import FIGURES
from benchmarks.latency.rows import ways
from benchmarks.latency.session import Session
from benchmarks.report import Drawing
from sdrlinkd.colors import COLORS
from sdrlinkd.pictures import legend_beside, looks, make_figure, save

COMMAND = "python -m benchmarks.latency"
WAYS = {"fwd": "odometry, companion to FCU", "bwd": "IMU, FCU to companion"}
SHOWN = 200
"""Messages in a row."""
KEPT = 1500
LONGEST_MS = 8.0


def drawing(found: Mapping[str, list[Session]]) -> Drawing:
    """What the figures show: latencies in ms by way and system, processor and memory."""
    return Drawing("latency", {
        "ways": {
            way: {name: 1e3 * ways(passes[0])[way].true_s[:KEPT] for name, passes in found.items()}
            for way in WAYS
        },
        "load": {
            what: {name: dict(getattr(passes[0], what)) for name, passes in found.items()}
            for what in ("cpu_share", "rss_mib")
        },
    })  # fmt: skip


def draw(shows: Mapping[str, Any]) -> None:
    """Draw docs/figures/latency_*.png."""
    for way, title in WAYS.items():
        figure, panels = make_figure(2, 1, (8.0, 6.0))
        series, density = panels[:, 0]
        by_name = shows["ways"][way]
        for (name, latencies), look in zip(
            by_name.items(), looks(by_name, "line").values(), strict=True
        ):
            latencies_ms = np.array(latencies, float)
            if len(latencies_ms) < 2:
                continue
            own = {"color": look.color, "linestyle": look.line, "label": name}
            series.plot(latencies_ms[:SHOWN], lw=1.0, **own)
            near = latencies_ms[latencies_ms < LONGEST_MS]
            if len(near) > 2 and np.std(near) > 0:
                x = np.linspace(0, LONGEST_MS, 400)
                density.plot(x, gaussian_kde(near)(x), **own)
        series.set(xlabel="message", ylabel="latency in ms", ylim=(0, LONGEST_MS))
        density.set(xlabel="latency in ms", ylabel="density per ms")
        legend_beside(series)
        legend_beside(density)
        figure.suptitle(f"{title}: 115 bytes at 200 Hz", fontsize=10)
        beyond = "" if "ether" not in by_name else f"; ether: mostly above {LONGEST_MS:g} ms"
        save(figure, FIGURES / f"latency_{way}.png", COMMAND + beyond)
    _load(shows["load"])


def _load(load: Mapping[str, Mapping[str, Mapping[str, float]]]) -> None:
    figure, panels = make_figure(1, 2, (9.0, 3.2))
    for axes, (what, unit) in zip(
        panels[0],
        (("cpu_share", "processor, in cores"), ("rss_mib", "memory, in MiB")),
        strict=True,
    ):
        names = list(load[what])
        base = np.zeros(len(names))
        processes = sorted({each for of in load[what].values() for each in of})
        for number, process in enumerate(processes):
            values = np.array([load[what][name].get(process, 0.0) for name in names])
            axes.barh(
                names, values, left=base, label=process, color=COLORS[number % len(COLORS)],
                edgecolor="white", hatch=("", "///", "...", "xx")[number // 2 % 4],
            )  # fmt: skip
            base += values
        axes.set_xlabel(unit)
        axes.invert_yaxis()
    legend_beside(panels[0, 1])
    save(figure, FIGURES / "latency_load.png", COMMAND)
