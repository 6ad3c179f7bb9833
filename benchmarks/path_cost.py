"""Cost of packetize + parse + reassemble, relative to the work that no implementation can avoid."""

import binascii
import statistics
import time
from random import Random

import numpy as np

from benchmarks.report import Row
from sdrlinkd.adapters import BuiltInRobot, empty, to_cdr
from sdrlinkd.link import (
    AccessParams,
    Link,
    LinkParams,
    Opportunity,
    Outcome,
    PduLinkTraits,
    QueueParams,
    RateParams,
    ReassemblyParams,
)
from sdrlinkd.wire import make_registry

PDU_SIZE = 1024
IMAGE_BYTES = 65_536
BURST_S = 0.1  # ids of fragmented messages are not reused within this time
PDU_S = 1e-3


def path_cost_row(seed: int, rounds: int) -> Row:
    """CPU time of the path relative to the CRC at both ends and one join of the same bytes.

    The worst of three payloads counts; path and baseline alternate, and the median of the ratios
    counts.
    """
    rng = Random(seed)
    payloads = {
        "real_scan_64KB": [_dense_scan(seed)] * 4,
        "random_64KB": [rng.randbytes(IMAGE_BYTES) for _ in range(4)],
        "zeros_64KB": [bytes(IMAGE_BYTES)] * 4,
    }
    ratios = {name: _ratio(messages, seed, rounds) for name, messages in payloads.items()}
    value = max(ratios.values())
    # Messages that fill only part of a PDU cost per message, not per byte: reported separately.
    robot = [message.cdr for message in BuiltInRobot("robot_1", 10.0, seed).messages()]
    for size in (724, 1500):
        short = [cdr for cdr in robot if len(cdr) == size]
        ratios[f"short_{size}B"] = _ratio(short, seed, rounds)
    return Row(
        "path_cost_over_crc_and_join_1024B", value, "ratio", 4.0, "less",
        rounds * len(payloads), peers=ratios,
        note="by payload; baseline: CRC-16 at sender and receiver and one join",
    )  # fmt: skip


def _dense_scan(seed: int) -> bytes:
    """A laser scan with 16 000 beams, as CDR."""
    scan = empty("sensor_msgs/msg/LaserScan")
    scan.header.frame_id = "laser"
    scan.ranges = np.random.default_rng(seed).uniform(0.1, 12, 16_000).astype(np.float32)
    return to_cdr(scan, "sensor_msgs/msg/LaserScan")


def _ratio(messages: list[bytes], seed: int, rounds: int) -> float:
    return statistics.median(_round(messages, seed + i) for i in range(rounds))


def _round(messages: list[bytes], seed: int) -> float:
    link = Link(
        LinkParams(pdu_size=PDU_SIZE, beacon_s=0.0),
        QueueParams(max_bytes=1 << 26),
        ReassemblyParams(),
        make_registry([("odom", "nav_msgs/Odometry")]),
        1,
        Random(seed),
        hears_self=True,
    )
    link.attach(PduLinkTraits(), AccessParams(), RateParams())
    for message in messages:
        link.submit(0, message, 0.0)
    pdus: list[bytes] = []
    heard: list[bytes] = []
    start = time.process_time()
    now = 0.0
    while burst := link.next_burst(Opportunity(now, lambda _, n: n * PDU_S, lambda *_: 16)):
        pdus += burst.pdus
        link.confirm(burst, Outcome.SENT, now)
        now += BURST_S
    for pdu in pdus:
        heard += [message.payload for message in link.hear(pdu, 0.0)]
    path_s = time.process_time() - start
    if heard != messages:
        raise RuntimeError(f"seed {seed}: the path changed the messages")
    start = time.process_time()
    for pdu in pdus:
        binascii.crc_hqx(pdu, 0)
    for pdu in pdus:
        binascii.crc_hqx(pdu, 0)
    b"".join(pdus)
    return path_s / (time.process_time() - start)
