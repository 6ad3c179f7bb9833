"""Latency beside MAVLink and XRCE-DDS: `python -m benchmarks.latency [--quick] [--json]`.

What is emulated: the serial line (two pseudo-terminals, paced at 921600 baud), the FCU (a process
with a clock of its own), the agent and MAVROS (Python, as all of it). A whole run draws
docs/figures/latency_*.png.
"""

import sys

from benchmarks.latency import pictures, rows
from benchmarks.peers.latency.table import unavailable
from benchmarks.report import Row, main


def measure(seed: int, quick: bool) -> list[Row]:
    """All rows."""
    seconds, passes = (3.0, 1) if quick else (15.0, 3)
    found = rows.sessions(seed, seconds, passes)
    for name in rows.TOLD:
        if (reason := unavailable(name)) is not None:
            sys.stderr.write(f"not measured: {name}: {reason}\n")
    told = [
        *rows.table(found),
        *rows.load(found),
        *rows.beyond_air(found),
        *rows.by_the_air(seed, 3.0 if quick else 20.0),
        *rows.by_the_clock(5.0 if quick else 30.0),
        *rows.shares(seed, 20.0 if quick else 120.0),
        rows.under_stress(seed, seconds, passes),
        rows.more_topics(seed, 3.0 if quick else 6.0, quick),
        rows.correction(seed, 10 if quick else 100),
    ]
    if not quick:
        pictures.draw(found)
    return told


if __name__ == "__main__":
    sys.exit(main("latency", measure))
