"""All rows: `python -m benchmarks.fleet`."""

import sys
from collections.abc import Iterator

from benchmarks.absent import attempt
from benchmarks.fleet import diversity_rows, faults_rows, load_rows, page_rows, wan_rows
from benchmarks.report import Row, main

ROWS = {
    "several gateways": diversity_rows.rows,
    "a wide-area network": wan_rows.rows,
    "faults": faults_rows.rows,
    "many robots": load_rows.rows,
    "the page": page_rows.rows,
}


def measure(seed: int, quick: bool) -> Iterator[Row]:
    """Measure all rows; `quick` sends a tenth."""
    for name, rows in ROWS.items():
        with attempt(name):
            yield from rows(seed, quick)


if __name__ == "__main__":
    sys.exit(main("fleet", measure))
