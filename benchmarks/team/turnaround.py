"""`grant` on half-duplex radios with a turnaround of 50 ms: how long something urgent waits."""

from itertools import combinations
from typing import NamedTuple

import numpy as np

from benchmarks.team.teams import Flow, Team

ROBOTS = 5
TURNAROUND_S = 0.05
RATE_BYTES = 7.5e5
"""What the air carries in a second."""
BULK_SIZE, PERIOD_S = 4096, 1.0
BEGIN_S, REST_S = 5.0, 5.0
LIFESPAN_S = 60.0
"""So long that none is dropped: a wait that ends nowhere would not count."""


class Waits(NamedTuple):
    """How long urgent messages waited."""

    p99_s: float
    longest_round_s: float
    mdr: float
    n: int
    forwarded: int
    """PDUs that robots forwarded, though all hear all."""


def wait_for_turns(size: int, seed: int, duration_s: float) -> Waits:
    """The delays of urgent messages of `size` octets.

    Four robots have more bulk than the air carries; the fifth sends the urgent messages.
    """
    ids = range(1, ROBOTS + 1)
    period_s = BULK_SIZE * (ROBOTS - 1) / RATE_BYTES
    flows = [
        Flow(
            f"bulk_{node}", node, 255, BULK_SIZE, period_s, round(duration_s / period_s), BEGIN_S,
            qos="bulk",
        )
        for node in ids[:-1]
    ]  # fmt: skip
    n = round(duration_s / PERIOD_S)
    flows.append(
        Flow(
            "urgent", ids[-1], 255, size, PERIOD_S, n, BEGIN_S, counted_at=1, qos="urgent",
            lifespan_s=LIFESPAN_S, is_random=True,
        )
    )  # fmt: skip
    team = Team(ids, list(combinations(ids, 2)), flows, seed, "grant", turnaround_s=TURNAROUND_S)
    urgent = team.heard[-1]
    team.simulation.run(urgent.sent_at[-1] + REST_S)
    round_s = team.simulation.stations[1].settled.access.round_s
    forwarded = sum(team.forwarded(node) for node in ids)
    return Waits(float(np.quantile(urgent.delays_s, 0.99)), round_s, urgent.mdr, n, forwarded)
