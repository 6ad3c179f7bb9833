"""The cost of scheduling decisions: queue, classes, shares, forecasts."""

import binascii
import gc
import statistics
import time
from random import Random

from benchmarks.queue_cost import make_queue, opportunity, queue_cost_row
from benchmarks.report import Row
from sdrlinkd.link import Outcome, Overrides, Qos

MESSAGE = 65_536
MOST = 14


def rows(seed: int, rounds: int) -> list[Row]:
    """Both rows about the cost of scheduling decisions."""
    over = [_over_crc_and_join(seed + i) for i in range(rounds)]
    return [
        queue_cost_row("scheduler_cost_ratio_10_to_10000_queued", seed, rounds),
        Row(
            "scheduler_cost_over_crc_and_join_1024B", statistics.median(over), "ratio", 3.0, "less",
            rounds, note="submit to confirmed burst, over CRC-16 at both ends and one join",
        ),
    ]  # fmt: skip


def _over_crc_and_join(seed: int) -> float:
    """Cost with bulk images, and a laser whose messages have to be forecast."""
    link, rng = make_queue(seed), Random(seed)
    images = [rng.randbytes(MESSAGE) for _ in range(4)]
    laser = bytes(990)
    pdus: list[bytes] = []
    # A topic shuffles its entry ids once, so that is done beforehand.
    for topic in (0, 1):
        link.submit(topic, laser, -1.0)
        first = link.next_burst(opportunity(-1.0, MOST))
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
        burst = link.next_burst(opportunity(now, MOST))
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
