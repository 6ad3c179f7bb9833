"""Compares clock filters: `python -m benchmarks.timesync [--quick] [--json]`.

`--keep` keeps the rows, and what the figures show, for docs/benchmarks.md.
"""

import sys
from collections.abc import Iterator

from benchmarks.report import Drawing, Row, exactly, main
from benchmarks.timesync import moving_rows, pictures, rows

HZ = 5.0
QUICK_S = 300.0
"""Longest stream of a moving clock with `--quick`, in s."""


def measure(seed: int, quick: bool) -> Iterator[Row | Drawing]:
    """Measure the rows of all filters and scenarios."""
    runs, stepped = (4, 1) if quick else (40, 8)
    held = rows.Tally()
    found = rows.precision(seed, runs, HZ, held)
    yield from exactly(rows.precision_rows(found, HZ))
    yield from exactly([rows.steps(seed, stepped, HZ, held)])
    yield from exactly(rows.hostile(seed, runs, HZ, held))
    yield Row("bound_holds_pct", held.percent, "%", 99.9, "more", held.all,
              note="all scenarios, without the 5 s after each step", exact=True)  # fmt: skip
    of_moving = (1, QUICK_S) if quick else (8, float("inf"))
    yield from exactly(moving_rows.measure(seed, *of_moving))
    yield from exactly([rows.sample_clocks(seed, 15.0 if quick else 60.0)])
    yield from exactly(rows.recorded())
    if not quick:
        yield pictures.drawing(found, HZ)


if __name__ == "__main__":
    sys.exit(main("timesync", measure))
