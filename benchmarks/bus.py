"""The path inside the daemon: bus to queue, queue to PDUs, PDUs to messages, and all together."""

import sys
from collections.abc import Iterator

from benchmarks.bus_ingress import ingress_row
from benchmarks.bus_latency import latency_row
from benchmarks.path_cost import path_cost_row
from benchmarks.queue_cost import queue_cost_row
from benchmarks.report import Row, main


def measure(seed: int, quick: bool) -> Iterator[Row]:
    """Measure all rows; `quick` takes about a tenth of the trials."""
    yield ingress_row(6_000 if quick else 60_000, 3 if quick else 5)
    yield path_cost_row(seed, 8 if quick else 60)
    yield latency_row(100 if quick else 1500)
    yield queue_cost_row("queue_cost_ratio_10_to_10000", seed, 5 if quick else 45)


if __name__ == "__main__":
    sys.exit(main("bus", measure))
