"""All rows: `python -m benchmarks.team`."""

import argparse
import sys
from collections.abc import Iterator

from benchmarks.absent import attempt
from benchmarks.report import Row, exactly, main
from benchmarks.team import (
    chain_rows,
    crowd_rows,
    driving_rows,
    healing_rows,
    rtwmp_rows,
    turnaround_rows,
    worst_rows,
)
from benchmarks.team.runs import Runs

ROWS = {
    "chains": chain_rows.rows,
    "robots that drive": driving_rows.rows,
    "slow radios": turnaround_rows.rows,
    "crowds": crowd_rows.rows,
    "the worst case": worst_rows.rows,
    "routes that heal": healing_rows.rows,
    "RT-WMP": rtwmp_rows.rows,
}
"""Each adds its simulations at once, and returns its rows, which wait for them."""


def measure(seed: int, quick: bool, processes: int = 0) -> Iterator[Row]:
    """Measure all rows; `quick` takes a tenth of the trials."""
    with Runs(processes) as runs:
        groups = {name: rows(runs, seed, quick) for name, rows in ROWS.items()}
        for name, found in groups.items():
            with attempt(name):
                yield from exactly(found)


def _own() -> argparse.ArgumentParser:
    own = argparse.ArgumentParser(add_help=False)
    own.add_argument(
        "--processes", type=int, default=0, metavar="N",
        help="simulations at once (default: one a core); the values are the same",
    )  # fmt: skip
    return own


if __name__ == "__main__":
    sys.exit(main("team", measure, _own()))
