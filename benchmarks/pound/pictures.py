"""The figures: the laser's outcome compared with others, bandwidth, and the control loop."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from benchmarks.flows import Figures
from benchmarks.kept import FIGURES
from benchmarks.peers.pound.control import EVERY, PERIOD_S, TICK_S, undelayed
from benchmarks.pound import limits, loop, tables
from benchmarks.pound.beside import LOOP_S
from benchmarks.report import Drawing
from sdrlinkd.colors import COLORS
from sdrlinkd.pictures import OURS, legend_beside, looks, make_figure, save

COMMAND = "python -m benchmarks.pound"
FLOWS = ("laser", "image")


def drawing(
    seed: int,
    one_hop: Mapping[str, Mapping[str, Figures]],
    mbps: Mapping[str, Mapping[int, float]],
    loops: Mapping[str, float],
    phase_s: float,
) -> Drawing:
    """What the figures show, ours beside the others."""
    ours = tables.by_flow(tables.two_nodes(seed, quick=False).traces)
    ticks = round(LOOP_S / TICK_S)
    return Drawing("beside", {
        "delays": {
            name: {flow: of[flow]._asdict() for flow in FLOWS}
            for name, of in {"sdrlinkd": ours, **one_hop}.items()
        },
        "mbps": {
            "sdrlinkd": {size: limits.bandwidth(size, 5.0, seed) for size in limits.SIZES}, **mbps,
        },
        "loops_mv": dict(loops),
        "loop_v": {
            "local": undelayed(ticks)[::EVERY],
            "sdrlinkd": loop.run_loop(phase_s, seed, ticks)[::EVERY],
        },
    })  # fmt: skip


def draw(shows: Mapping[str, Any]) -> None:
    """Draw docs/figures/pound_*.png."""
    _delays(shows["delays"])
    _bandwidth_and_loop(shows)


def _delays(delays: Mapping[str, Mapping[str, Mapping[str, float]]]) -> None:
    """A row for each system, a panel for each flow: what is better lies further left."""
    names = sorted(delays, key=lambda name: delays[name]["laser"]["d_ms"], reverse=True)
    figure, panels = make_figure(1, 2, (9.0, 0.9 + 0.27 * len(names)), sharey=True)
    at = np.arange(len(names))
    for axes, flow in zip(panels[0], FLOWS, strict=True):
        for y, name in enumerate(names):
            of, color = delays[name][flow], OURS if name == "sdrlinkd" else COLORS[2]
            least = of["d_ms"] - min(of["std_d_ms"], 0.8 * of["d_ms"])
            axes.hlines(y, least, of["d_ms"] + of["std_d_ms"], color=color, linewidth=1.2)
            axes.plot(of["d_ms"], y, "o", color=color, markersize=5)
            axes.plot(of["std_jd_ms"], y, "|", color=COLORS[4], markersize=9, markeredgewidth=1.6)
        axes.set(xscale="log", xlabel=f"{flow}, ms")
        axes.xaxis.set_major_formatter("{x:g}")
    panels[0, 0].set_yticks(at, [name.replace("_", " ") for name in names], fontsize=8)
    for label in panels[0, 0].get_yticklabels():
        label.set_fontweight("bold" if label.get_text() == "sdrlinkd" else "normal")
    save(figure, FIGURES / "pound_delays.png",
         f"{COMMAND}; dots: mean delay; lines: its standard deviation; red ticks: standard "
         "deviation of the time between arrivals")  # fmt: skip


def _bandwidth_and_loop(shows: Mapping[str, Any]) -> None:
    figure, panels = make_figure(2, 1, (8.0, 7.0))
    bandwidth, voltage = panels[:, 0]
    for (name, by_size), look in zip(
        shows["mbps"].items(), looks(shows["mbps"], "sdrlinkd").values(), strict=True
    ):
        bandwidth.plot(
            [int(size) / 1024 for size in by_size], list(by_size.values()), color=look.color,
            linestyle=look.line, marker=look.marker, markersize=4, label=name.replace("_", " "),
        )  # fmt: skip
    bandwidth.set(
        xscale="log", xlabel="KiB a message", ylabel="Mbit/s for the user, of 6", ylim=(0, 6.2)
    )
    bandwidth.xaxis.set_major_formatter("{x:g}")
    legend_beside(bandwidth)
    at = PERIOD_S * np.arange(len(shows["loop_v"]["local"]))
    voltage.plot(at, shows["loop_v"]["local"], color=COLORS[1], lw=4, alpha=0.6, label="local")
    voltage.plot(at, shows["loop_v"]["sdrlinkd"], color=OURS, lw=1, label="through sdrlinkd")
    voltage.set(xlabel="time in s", ylabel="voltage in V")
    errors = sorted(shows["loops_mv"].items(), key=lambda each: each[1])
    told = [f"{name.replace('_', ' ')} {mv:.1f} mV" for name, mv in errors]
    legend_beside(voltage, "\n".join(["off the local run, rms:", *told]))
    save(figure, FIGURES / "pound_bandwidth_and_loop.png", COMMAND)
