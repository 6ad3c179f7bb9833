"""Whole daemons in real time: `python -m benchmarks.realtime [--quick] [--json] [--keep]`.

`--rows NAME ...` measures only these rows. `--beside DIR` names another checkout, which is measured
in turns with this one; its medians are the peer `before`.
"""

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from benchmarks.environments import ROOT
from benchmarks.realtime.rows import NAMES, rows
from benchmarks.realtime.trees import checkout, prepare
from benchmarks.realtime.turns import BEFORE, HERE
from benchmarks.report import Row, main


def measure(
    seed: int, quick: bool, rows_only: Sequence[str] = NAMES, beside: Path | None = None
) -> Iterator[Row]:
    """Measure the rows of this checkout, in turns with another one if it is given."""
    trees = {HERE: ROOT} | ({} if beside is None else {BEFORE: beside})
    for tree in trees.values():
        prepare(tree)
    yield from rows(rows_only, trees, seed, quick)


if __name__ == "__main__":
    own = argparse.ArgumentParser(add_help=False)
    own.add_argument(
        "--rows", nargs="+", choices=NAMES, default=NAMES, metavar="NAME", dest="rows_only",
        help=f"measure only these rows, of {', '.join(NAMES)}",
    )  # fmt: skip
    own.add_argument("--beside", type=checkout, metavar="DIR", help="another checkout")
    sys.exit(main("realtime", measure, own))
