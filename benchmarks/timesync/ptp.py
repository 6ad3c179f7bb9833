"""Recorded PTP over robots' Wi-Fi: one offset and one path delay per second.

The recorded servo slewed its clock by up to 500 ppm. Its corrections are removed, so that a
straight line remains.
"""

import csv
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.timesync.filters import Filter
from benchmarks.timesync.streams import Exchange

FOLDER = Path(__file__).parents[3] / "shared" / "data" / "traces"
SETTLING = 30
"""Number of samples before a filter counts."""


class Trace(NamedTuple):
    """A recording, by the slave's time in s."""

    name: str
    at: np.ndarray
    offset_s: np.ndarray
    path_s: np.ndarray


def traces() -> Iterator[Trace]:
    """The recordings on this machine."""
    for path in sorted(FOLDER.glob("ptp_log_*.csv")):
        rows, last = [], None
        with path.open() as file:
            for row in csv.DictReader(file):
                number = (row["sync_received"], row["offset_from_master_s"])
                if row["offset_from_master_s"] and float(row["mean_path_delay_s"]) > 0:
                    if number != last:
                        rows.append(row)
                    last = number
        at = np.array([1e-9 * int(row["t_ns"]) for row in rows])
        offset_s = np.array([float(row["offset_from_master_s"]) for row in rows])
        path_s = np.array([float(row["mean_path_delay_s"]) for row in rows])
        ppm = np.array([float(row["clock_correction_ppm"]) for row in rows])
        slewed_s = np.concatenate(([0.0], np.cumsum(1e-6 * ppm[:-1] * np.diff(at))))
        yield Trace(path.stem, at - at[0], offset_s - slewed_s, path_s)


def spread_ms(make: Callable[[], Filter], trace: Trace) -> float:
    """RMS deviation of a filter's output from a line, in ms; free-running clocks follow a line."""
    filter_, said = make(), []
    for at, offset_s, path_s in zip(*trace[1:], strict=True):
        # PTP: offset = delay of one way - path delay; both ways give the path delay.
        there_s, back_s = offset_s + path_s, path_s - offset_s
        t1, t4 = float(at), float(at + 1e-3)
        filter_.take(Exchange(t1, t1 + float(back_s), t4 - float(there_s), t4))
        found = filter_.offset(t4)
        said.append(np.nan if found is None else found)
    x, y = trace.at[SETTLING:], np.array(said)[SETTLING:]
    known = np.isfinite(y)
    if not known.any():
        # No round trip was short enough for the filter.
        return float("inf")
    line = np.polyfit(x[known], y[known], 1)
    return float(1e3 * np.sqrt(np.mean(np.square(y[known] - np.polyval(line, x[known])))))
