"""Compares the cost per message of a long queue with that of a short one."""

import gc
import statistics
import time
from random import Random

from benchmarks.report import Row
from sdrlinkd.link import (
    AccessParams,
    Link,
    LinkParams,
    Opportunity,
    Outcome,
    Overrides,
    PduLinkTraits,
    Qos,
    QueueParams,
    RateParams,
    ReassemblyParams,
)
from sdrlinkd.wire import make_registry

OPERATIONS = 1000
TOPICS = 15
PDU_SIZE = 1024
PDU_S = 1.4e-3
OVERHEAD_S = 1e-4


def queue_cost_row(name: str, seed: int, rounds: int) -> Row:
    """CPU time of deciding one message with 10 000 queued over that with 10 queued."""
    ratios = [_per_message(10_000, seed + i) / _per_message(10, seed + i) for i in range(rounds)]
    return Row(
        name, statistics.median(ratios), "ratio", 1.3, "less", rounds,
        note="15 topics in four classes, random priorities; median of paired rounds",
    )  # fmt: skip


def make_queue(seed: int) -> Link:
    """A link with room for any number of messages, on an air of its own."""
    link = Link(
        LinkParams(pdu_size=PDU_SIZE, beacon_s=0.0),
        QueueParams(max_messages=1_000_000, max_bytes=1 << 30),
        ReassemblyParams(),
        make_registry([(f"topic_{i}", "nav_msgs/Odometry") for i in range(TOPICS)]),
        1,
        Random(seed),
    )
    link.attach(PduLinkTraits(), AccessParams(), RateParams())
    return link


def opportunity(now: float, most: int) -> Opportunity:
    """An opportunity for a burst of `most` PDUs."""

    def most_pdus(_: int, airtime_s: float) -> int:
        return int(min(most, max(0.0, (airtime_s - OVERHEAD_S) / PDU_S)))

    return Opportunity(now, _airtime_s, most_pdus)


def _airtime_s(_: int, n_pdus: int) -> float:
    return OVERHEAD_S + n_pdus * PDU_S


def _per_message(depth: int, seed: int) -> float:
    """CPU time of one message in and a burst of one PDU out, with `depth` messages queued."""
    rng = Random(seed)
    link, payload = make_queue(seed), bytes(700)
    wishes = [Overrides(Qos(topic % 4), priority=8 * topic) for topic in range(TOPICS)]
    topics = [rng.randrange(TOPICS) for _ in range(depth + OPERATIONS)]
    for topic in topics[:depth]:
        link.submit(topic, payload, 0.0, wishes[topic])
    now = 0.0
    gc.collect()
    start = time.process_time()
    for topic in topics[depth:]:
        link.submit(topic, payload, now, wishes[topic])
        burst = link.next_burst(opportunity(now, 1))
        if burst is not None:
            link.confirm(burst, Outcome.SENT, now)
        now += 2 * PDU_S
    return time.process_time() - start
