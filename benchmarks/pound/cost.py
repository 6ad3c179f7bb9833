"""What deciding costs: queue, classes, shares, forecasts."""

import binascii
import gc
import statistics
import time
from random import Random

from benchmarks.report import Row
from sdrlinkd.link import (
    AccessParams,
    CarrierTraits,
    Link,
    LinkParams,
    Opportunity,
    Outcome,
    Overrides,
    Qos,
    QueueParams,
    RateParams,
    ReassemblyParams,
)
from sdrlinkd.wire import make_registry

TOPICS = 15
PDU_SIZE = 1024
MESSAGE = 65_536
OPERATIONS = 1000
PDU_S = 1.4e-3
OVERHEAD_S = 1e-4
MOST = 14


def rows(seed: int, rounds: int) -> list[Row]:
    """Both of them."""
    ratios = [_per_message(10_000, seed + i) / _per_message(10, seed + i) for i in range(rounds)]
    over = [_over_crc_and_join(seed + i) for i in range(rounds)]
    return [
        Row(
            "scheduler_cost_ratio_10_to_10000_queued", statistics.median(ratios), "ratio", 1.3,
            "less", rounds, note="15 topics in four classes, random priorities; median of pairs",
        ),
        Row(
            "scheduler_cost_over_crc_and_join_1024B", statistics.median(over), "ratio", 3.0, "less",
            rounds, note="submit to confirmed burst, over CRC-16 at both ends and one join",
        ),
    ]  # fmt: skip


def _link(seed: int) -> Link:
    link = Link(
        LinkParams(pdu_size=PDU_SIZE, beacon_s=0.0),
        QueueParams(max_messages=1_000_000, max_bytes=1 << 30),
        ReassemblyParams(),
        make_registry([(f"topic_{i}", "nav_msgs/Odometry") for i in range(TOPICS)]),
        1,
        Random(seed),
    )
    link.attach(CarrierTraits(), AccessParams(), RateParams())
    return link


def _airtime_s(_: int, n_pdus: int) -> float:
    return OVERHEAD_S + n_pdus * PDU_S


def _most_pdus(_: int, airtime_s: float) -> int:
    return int(min(MOST, max(0.0, (airtime_s - OVERHEAD_S) / PDU_S)))


def _opportunity(now: float) -> Opportunity:
    return Opportunity(now, _airtime_s, _most_pdus)


def _per_message(depth: int, seed: int) -> float:
    """CPU time of a message in and a burst of one PDU out, with `depth` waiting."""
    rng = Random(seed)
    link, payload = _link(seed), bytes(700)
    wishes = [Overrides(Qos(topic % 4), priority=8 * topic) for topic in range(TOPICS)]
    topics = [rng.randrange(TOPICS) for _ in range(depth + OPERATIONS)]
    for topic in topics[:depth]:
        link.submit(topic, payload, 0.0, wishes[topic])
    now = 0.0
    gc.collect()
    start = time.process_time()
    for topic in topics[depth:]:
        link.submit(topic, payload, now, wishes[topic])
        burst = link.next_burst(Opportunity(now, _airtime_s, _one_pdu))
        if burst is not None:
            link.confirm(burst, Outcome.SENT, now)
        now += 2 * PDU_S
    return time.process_time() - start


def _one_pdu(_: int, airtime_s: float) -> int:
    return int(airtime_s >= OVERHEAD_S + PDU_S)


def _over_crc_and_join(seed: int) -> float:
    """Images in bulk, and a laser that has to be foreseen."""
    link, rng = _link(seed), Random(seed)
    images = [rng.randbytes(MESSAGE) for _ in range(4)]
    laser = bytes(990)
    pdus: list[bytes] = []
    # A topic shuffles its entry ids once.
    for topic in (0, 1):
        link.submit(topic, laser, -1.0)
        first = link.next_burst(_opportunity(-1.0))
        if first is not None:
            link.confirm(first, Outcome.SENT, -1.0)
    now, due = 0.0, 0.02
    gc.collect()
    start = time.process_time()
    for image in images:
        link.submit(0, image, now, Overrides(Qos.BULK))
    while link.has_work:
        if now >= due:
            link.submit(1, laser, due, Overrides(Qos.LATENCY))
            due += 0.02
        burst = link.next_burst(_opportunity(now))
        if burst is None:
            now = max(now + 1e-3, min(due, link.next_wakeup(now)))
            continue
        pdus += burst.pdus
        now = burst.start + burst.airtime_s
        link.confirm(burst, Outcome.SENT, now)
    path_s = time.process_time() - start
    start = time.process_time()
    for pdu in pdus + pdus:
        binascii.crc_hqx(pdu, 0)
    b"".join(pdus)
    return path_s / (time.process_time() - start)
