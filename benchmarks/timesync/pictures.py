"""The figures of the clock filters' errors."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from benchmarks.timesync.rows import TOLD, rms_us
from benchmarks.timesync.runs import Course

FOLDER = Path(__file__).parents[2] / "docs" / "figures"
COMMAND = "python -m benchmarks.timesync"


def draw(found: dict[str, dict[str, list[Course]]], hz: float) -> None:
    """Draw the errors of every filter over time, and at the end."""
    names = list(found["A"])
    figure, axes = plt.subplots(2, 3, figsize=(11, 6), sharex=True, sharey=True)
    for scenario, axis in zip(TOLD, axes.flat, strict=True):
        for name in names:
            errors = np.array([each.error_s for each in found[scenario][name]])
            at = found[scenario][name][0].at
            middle = 1e6 * np.nanmedian(np.abs(np.nan_to_num(errors, nan=1.0)), axis=0)
            axis.semilogy(at, middle, label=name.replace("_", " "), lw=1.2)
        bounds = np.array([each.bound_s for each in found[scenario]["ours"]])
        axis.semilogy(at, 1e6 * np.nanmedian(bounds, axis=0), ":", color="grey", label="our bound")
        axis.set_title(f"scenario {scenario}", fontsize=9)
        axis.set_ylim(0.5, 1e6)
        axis.grid(alpha=0.3)
    axes[0, 0].legend(fontsize=7)
    figure.supxlabel(
        f"s after the start, {hz:g} exchanges a second, 10 % lost each way", fontsize=9
    )
    figure.supylabel("error of the clock offset, µs (median)", fontsize=9)
    figure.text(0.99, 0.005, COMMAND, ha="right", fontsize=6, color="grey")
    figure.tight_layout()
    FOLDER.mkdir(parents=True, exist_ok=True)
    figure.savefig(FOLDER / "timesync_errors.png", dpi=120)
    plt.close(figure)
    _bars(found, names, hz)


def _bars(found: dict[str, dict[str, list[Course]]], names: list[str], hz: float) -> None:
    figure, axis = plt.subplots(figsize=(8, 3.6))
    width = 0.8 / len(names)
    for number, name in enumerate(names):
        values = [rms_us(found[scenario][name]) for scenario in TOLD]
        places = np.arange(len(TOLD)) + number * width
        axis.bar(places, values, width, label=name.replace("_", " "))
    axis.set_yscale("log")
    axis.set_xticks(np.arange(len(TOLD)) + 0.4 - width / 2, list(TOLD))
    axis.set_xlabel("scenario")
    axis.set_ylabel("rms error at 60 s, µs")
    axis.legend(fontsize=8)
    axis.grid(axis="y", alpha=0.3)
    axis.set_title(f"{hz:g} exchanges a second", fontsize=9)
    figure.text(0.99, 0.005, COMMAND, ha="right", fontsize=6, color="grey")
    figure.tight_layout()
    figure.savefig(FOLDER / "timesync_rms.png", dpi=120)
    plt.close(figure)
