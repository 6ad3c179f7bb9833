"""Table V on one channel: the sender (2 nodes) or the relay (3 nodes) is off for 5 s.

Its radio neither sends nor receives. The robots learn the routes over the relay themselves.
"""

import numpy as np

from backends import LinkOverride, Outage
from benchmarks.flows import Flow
from benchmarks.peers.pound.runs import Recovery, recovery
from benchmarks.pound.limits import OUTAGE_S, latest_wins
from benchmarks.pound.ours import Air, Sent, prepare
from benchmarks.pound.tables import KB, LASER_S, TURNAROUND_S

TRIALS = 10
LEARN_S, REST_S = 3.0, 5.0
"""Time for clocks and routes before the flows begin, and from the radio's return to their end."""
NONE_DB = -300.0


def recoveries(nodes: int, policy: str, seed: int, quick: bool) -> list[Recovery]:
    """How both flows recover after the radio's return, in each trial."""
    rng = np.random.default_rng(seed)
    n = 1 if quick else TRIALS
    return [each for i in range(n) for each in _after(nodes, policy, rng, seed + i)]


def _after(nodes: int, policy: str, rng: np.random.Generator, seed: int) -> list[Recovery]:
    begin_s = LEARN_S + 1.0 + float(rng.uniform(0, 1.0))
    end_s = begin_s + OUTAGE_S
    count = int((end_s + REST_S - LEARN_S) / LASER_S)
    sent = [
        Sent(
            Flow(f"laser_{i}", KB, LASER_S, count, "latency",
                 phase_s=LEARN_S + float(rng.uniform(0, LASER_S))),
            1, nodes,
        )
        for i in range(2)
    ]  # fmt: skip
    apart = [LinkOverride(sender=1, receiver=3, snr_db=NONE_DB)] if nodes == 3 else []
    air = Air(
        nodes=nodes, policy=policy, full_duplex=False, turnaround_s=TURNAROUND_S, overrides=apart,
        learns_routes=nodes > 2, off={nodes - 1: [Outage(begin_s, end_s)]},
    )  # fmt: skip
    return [recovery(trace, end_s) for trace in prepare(sent, air, seed, latest_wins).finish()]
