"""The pictures of how clock filters err."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from benchmarks.kept import FIGURES
from benchmarks.report import Drawing
from benchmarks.timesync.rows import TOLD, rms_us
from benchmarks.timesync.runs import Course
from sdrlinkd.pictures import QUIET, legend_below, legend_beside, looks, make_figure, save

COMMAND = "python -m benchmarks.timesync"


def drawing(found: Mapping[str, Mapping[str, list[Course]]], hz: float) -> Drawing:
    """What the figures show: medians of all runs over time in µs, and errors at the end."""
    over_time: dict[str, Any] = {}
    for scenario in TOLD:
        courses = found[scenario]
        bounds = np.array([each.bound_s for each in courses["ours"]])
        over_time[scenario] = {
            "at": courses["ours"][0].at,
            "bound": 1e6 * np.nanmedian(bounds, axis=0),
            "errors": {
                name: 1e6 * np.nanmedian(
                    np.abs(np.nan_to_num([each.error_s for each in of], nan=1.0)), axis=0
                )
                for name, of in courses.items()
            },
        }  # fmt: skip
    at_end = {of: {name: rms_us(each) for name, each in found[of].items()} for of in TOLD}
    return Drawing("filters", {"hz": hz, "over_time": over_time, "at_end": at_end})


def draw(shows: Mapping[str, Any]) -> None:
    """Draw docs/figures/timesync_*.png."""
    figure, panels = make_figure(2, 3, (10.0, 6.2), sharex=True, sharey=True)
    for (scenario, of), axes in zip(shows["over_time"].items(), panels.flat, strict=True):
        at = np.array(of["at"], float)
        errors = of["errors"]
        for (name, middle), look in zip(
            errors.items(), looks(errors, "ours").values(), strict=True
        ):
            axes.semilogy(at, np.array(middle, float), color=look.color, linestyle=look.line,
                          lw=1.4, label=name.replace("_", " "))  # fmt: skip
        axes.semilogy(at, np.array(of["bound"], float), color=QUIET, lw=0.8, label="our bound")
        axes.set_title(f"scenario {scenario}", fontsize=9)
        axes.set_ylim(0.5, 1e6)
    figure.supxlabel(
        f"s after the start, {shows['hz']:g} exchanges a second, 10 % lost each way", fontsize=9
    )
    figure.supylabel("error of the clock offset in µs, median", fontsize=9)
    legend_below(figure, panels[0, 0], 6)
    save(figure, FIGURES / "timesync_errors.png", COMMAND)
    _at_end(shows)


def _at_end(shows: Mapping[str, Any]) -> None:
    figure, panels = make_figure(size=(8.0, 3.8))
    axes = panels[0, 0]
    names = list(shows["at_end"]["A"])
    for name, look in looks(names, "ours").items():
        values = [shows["at_end"][scenario][name] or np.nan for scenario in shows["at_end"]]
        axes.plot(list(shows["at_end"]), values, look.marker, color=look.color, markersize=7,
                  label=name.replace("_", " "))  # fmt: skip
    axes.set_yscale("log")
    axes.set(xlabel="scenario", ylabel="rms error at 60 s in µs")
    legend_beside(axes)
    save(figure, FIGURES / "timesync_rms.png", COMMAND)
