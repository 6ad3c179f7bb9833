"""Does a long queue cost more per message than a short one?"""

import gc
import statistics
import time
from random import Random

from benchmarks.report import Row
from sdrlinkd.link import (
    Allowance,
    Link,
    LinkParams,
    Outcome,
    Overrides,
    QueueParams,
    ReassemblyParams,
)
from sdrlinkd.wire import make_registry

OPERATIONS = 1000
TOPICS = 15


def queue_cost_row(seed: int, rounds: int) -> Row:
    """CPU time of submit + send of one message with 10 000 queued over that with 10 queued."""
    ratios = [_cost(10_000, seed + i) / _cost(10, seed + i) for i in range(rounds)]
    return Row(
        "queue_cost_ratio_10_to_10000", statistics.median(ratios), "ratio", 1.3, "less", rounds,
        note="15 topics in four classes, random priorities; median of paired rounds",
    )  # fmt: skip


def _cost(depth: int, seed: int) -> float:
    rng = Random(seed)
    link = Link(
        LinkParams(beacon_s=0.0),
        QueueParams(max_messages=1_000_000, max_bytes=1 << 30),
        ReassemblyParams(),
        make_registry([(f"topic_{i}", "nav_msgs/Odometry") for i in range(TOPICS)]),
        1,
        rng,
    )
    payload = bytes(700)
    wishes = [Overrides(priority=8 * topic) for topic in range(TOPICS)]
    topics = [rng.randrange(TOPICS) for _ in range(depth + OPERATIONS)]
    for topic in topics[:depth]:
        link.submit(topic, payload, 0.0, wishes[topic])
    gc.collect()
    start = time.process_time()
    for topic in topics[depth:]:
        link.submit(topic, payload, 0.0, wishes[topic])
        burst = link.departures.compose(0.0, Allowance.of(1))
        if burst is not None:
            link.confirm(burst, Outcome.SENT, 0.0)
    return time.process_time() - start
