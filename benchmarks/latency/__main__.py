"""Latency compared with MAVLink and XRCE-DDS.

`python -m benchmarks.latency [--quick] [--json] [--no-peers]`.

What is emulated: the serial line (paced at 921600 baud), the FCU (a process with a clock of its
own), the agent and MAVROS (Python, as all of it). Daemons reach the line by TCP, as they would
through ser2net, where the others have pseudo-terminals.
`--keep` keeps the rows, and what the figures show, for docs/benchmarks.md.
"""

import argparse
import sys
from collections.abc import Iterator

from benchmarks.absent import attempt
from benchmarks.latency import pictures, rows
from benchmarks.report import Drawing, Row, main


def measure(seed: int, quick: bool, no_peers: bool = False) -> Iterator[Row | Drawing]:
    """Measure the rows of the paper's table, of clocks and of ages."""
    seconds, passes = (3.0, 1) if quick else (15.0, 3)
    beside = () if no_peers else rows.BESIDE
    found = rows.sessions(seed, seconds, passes, of=rows.OURS if no_peers else rows.TOLD)
    yield from rows.table(found)
    yield from rows.load(found)
    yield from rows.beyond_air(found)
    yield from rows.by_the_air(seed, 3.0 if quick else 20.0)
    with attempt("two daemons in real time"):
        yield from rows.by_the_clock(5.0 if quick else 30.0)
    yield from rows.shares(seed, 20.0 if quick else 120.0)
    yield from rows.under_stress(seed, seconds, passes, beside)
    yield from rows.more_topics(seed, 3.0 if quick else 6.0, quick, beside)
    yield from rows.corrections(seed, 2 if quick else 20)
    if not (quick or no_peers):
        yield pictures.drawing(found)


if __name__ == "__main__":
    own = argparse.ArgumentParser(add_help=False)
    own.add_argument("--no-peers", action="store_true", help="only our own rows")
    sys.exit(main("latency", measure, own))
