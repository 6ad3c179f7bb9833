"""The figures: the laser's outcome compared with others, bandwidth, and the control loop."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from benchmarks.flows import Figures
from benchmarks.peers.pound.control import local_loop
from benchmarks.pound import limits, loop, tables
from benchmarks.pound.beside import LOOP_S

FOLDER = Path(__file__).parents[2] / "docs/figures"


def draw(
    seed: int,
    one_hop: Mapping[str, Mapping[str, Figures]],
    mbps: Mapping[str, Mapping[int, float]],
    loops: Mapping[str, float],
    phase_s: float,
) -> None:
    """Draw this benchmark's figures into docs/figures/pound_*.png."""
    import matplotlib.pyplot as plt

    FOLDER.mkdir(parents=True, exist_ok=True)
    ours = tables.by_flow(tables.two_nodes(seed, quick=False).traces)
    figure, axes = plt.subplots(1, 2, figsize=(11, 4.5))
    for ax, flow in zip(axes, ("laser", "image"), strict=True):
        for name, of in {**one_hop, "sdrlinkd": ours}.items():
            ours_too = name == "sdrlinkd"
            ax.errorbar(
                of[flow].d_ms, of[flow].std_jd_ms, xerr=of[flow].std_d_ms, fmt="o",
                color="k" if ours_too else None, label=name, ms=7 if ours_too else 4, capsize=2,
            )  # fmt: skip
        ax.set(xscale="log", yscale="log", xlabel=f"{flow}: delay D, ms (bars: std)",
               ylabel="std of the time between arrivals, ms")  # fmt: skip
        ax.grid(which="both", alpha=0.25)
    axes[1].legend(fontsize=7)
    figure.savefig(FOLDER / "pound_delays.png", dpi=110, bbox_inches="tight")

    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4))
    for name, by_size in mbps.items():
        left.plot([size / 1024 for size in by_size], list(by_size.values()), "o-", ms=3, label=name)
    here = [limits.bandwidth(size, 5.0, seed) for size in limits.SIZES]
    left.plot([size / 1024 for size in limits.SIZES], here, "ko-", label="sdrlinkd")
    left.set(xscale="log", xlabel="KB a message", ylabel="Mbit/s for the user, of 6", ylim=(0, 6.2))
    left.legend(fontsize=7)
    left.grid(alpha=0.25)
    ticks = round(LOOP_S / 0.02)
    at = 0.02 * np.arange(ticks)
    right.plot(at, local_loop(ticks), "C1", lw=4, alpha=0.5, label="local")
    right.plot(at, loop.run_loop(phase_s, seed, ticks), "k", lw=1, label="sdrlinkd")
    right.set(xlabel="s", ylabel="Vc, V")
    told = "\n".join(
        f"{name}: {rms:.1f} mV" for name, rms in sorted(loops.items(), key=lambda e: e[1])
    )
    right.text(0.98, 0.04, told, transform=right.transAxes, ha="right", fontsize=7)
    right.legend(loc="upper right", fontsize=8)
    figure.savefig(FOLDER / "pound_bandwidth_and_loop.png", dpi=110, bbox_inches="tight")
    plt.close("all")
