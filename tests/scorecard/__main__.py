"""Runs the scorecard: `python -m tests.scorecard [SECONDS] [--keep]`."""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from sdrlinkd.tables import FittedTable, figure, screen_console, words

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "reliability.md"
ROWS = 24
BEGIN, END = "<!-- the table -->", "<!-- its end -->"


def rows(seconds: float) -> tuple[list[tuple[int, str, str]], bool]:
    """(number, what, figure) of each row that passed, and whether all did."""
    with tempfile.TemporaryDirectory() as folder:
        told = Path(folder) / "rows.json"
        environment = {
            **os.environ, "SDRLINK_SECONDS": str(seconds), "SDRLINK_SCORECARD": str(told),
        }  # fmt: skip
        command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider"]
        done = subprocess.run(
            [*command, str(Path(__file__).parent)], cwd=ROOT, env=environment, check=False
        )
        found = json.loads(told.read_text()) if told.exists() else []
    return [(number, what, text) for number, what, text in found], done.returncode == 0


def keep(found: list[tuple[int, str, str]], seconds: float) -> None:
    """Write the table into the page."""
    before, rest = PAGE.read_text().split(BEGIN)
    after = rest.split(END)[1]
    lines = [f"| {number} | {what} | {text} |" for number, what, text in found]
    table = "\n".join(
        [f"Each row took {seconds:g} s.", "", "| | row | figure |", "|---|---|---|", *lines]
    )
    PAGE.write_text(f"{before}{BEGIN}\n{table}\n{END}{after}")


def main() -> int:
    """Run all rows; returns 1 unless each of them is green."""
    parser = argparse.ArgumentParser(prog="python -m tests.scorecard")
    parser.add_argument("seconds", type=float, nargs="?", default=60.0, help="duration of a row")
    parser.add_argument(
        "--keep", action="store_true", help="write the table of docs/reliability.md"
    )
    options = parser.parse_args()
    found, is_green = rows(options.seconds)
    table = FittedTable("scorecard", (figure("row"), words("what"), words("figure")))
    for number, what, text in found:
        table.add(str(number), what, text)
    console = screen_console()
    console.print(table)
    console.print(f"{len(found)} of {ROWS} rows are green", highlight=False)
    if options.keep:
        keep(found, options.seconds)
    return 0 if is_green and len(found) == ROWS else 1


if __name__ == "__main__":
    sys.exit(main())
