"""Odometry over radios like a HackRF: half duplex, whole transfers, no time stamps."""

import struct
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from benchmarks.processes import Stolen
from benchmarks.radio_pair import ROBOTS, Pair, pair
from benchmarks.report import Row
from sdrlinkd.adapters import BuiltInRobot
from sdrlinkd.client import Publisher, Subscriber

RATE_HZ, OVERSAMPLING = 2e6, 4
TRANSFER, IN_FLIGHT = 131_072, 4
TURNAROUND_S = 0.02
PERIOD_S = 0.1
MESSAGES, QUICK_MESSAGES = 300, 60
"""Messages of each robot; in the quick version, of both together."""
WARM_UP = 20
"""Messages before the measured ones: 2 s."""
DRAIN_S, LOOK_S = 2.0, 0.05
STAMP = slice(4, 12)
"""Position of the header's stamp in CDR."""
ODOM_HZ = 30
"""Rate of the recorded robot's odometry."""
MODEM = f"""[modem]
rate_hz = {RATE_HZ}
frequency_hz = 915e6
oversampling = {OVERSAMPLING}
"""
SOAPY = f"""turnaround_s = {TURNAROUND_S}
transfers_in_flight = {IN_FLIGHT}
"""
DEVICE = f",inflight={IN_FLIGHT},status=yes"
ACCESS = {
    "oneway": "",
    "twoway": '[access]\npolicy = "tdma"\nnodes = [1, 2]\nslot_s = 0.3\nreuse = false\n',
}
SENDERS = {"oneway": ROBOTS[:1], "twoway": ROBOTS}


@dataclass
class Flow:
    """Messages from one robot to the other: send and receive times in ns, by stamp."""

    sent: dict[bytes, int] = field(default_factory=dict)
    heard: dict[bytes, int] = field(default_factory=dict)

    def latencies_ms(self) -> list[float]:
        """The latencies of the messages that arrived."""
        return [1e-6 * (self.heard[each] - at) for each, at in self.sent.items()
                if each in self.heard]  # fmt: skip

    @property
    def is_complete(self) -> bool:
        """Whether all messages have arrived."""
        return self.sent.keys() <= self.heard.keys()

    def listen(self, ear: Subscriber, until: float) -> None:
        """Record arrivals until that time."""
        while (left_s := until - time.monotonic()) > 0:
            message = ear.receive(left_s)
            if message is not None:
                self.heard[message.payload[STAMP]] = time.time_ns()


def rows(seed: int, quick: bool) -> Iterator[Row]:
    """p50, p99 and the share that arrived, with one robot that sends and with two."""
    messages = {robot: _odometry(robot, seed) for robot in ROBOTS}
    for way, senders in SENDERS.items():
        count = QUICK_MESSAGES // len(senders) if quick else MESSAGES
        with (
            pair("hackrf", ["odom"], MODEM + ACCESS[way], SOAPY, DEVICE) as robots,
            ThreadPoolExecutor() as pool,
        ):
            sent = {robot: messages[robot][: WARM_UP + count] for robot in senders}
            stolen = Stolen()
            flows = list(pool.map(partial(_play, robots, seed), sent, sent.values()))
            looks = [robots.look(robot) for robot in ROBOTS]
        counted = {
            name: float(sum(look.counter(name) for look in looks))
            for name in ("tx_spells", "underflows", "late")
        }
        counted["machine_stolen_pct"] = stolen.pct()
        yield from _rows_of(way, flows, counted)


def _rows_of(way: str, flows: list[Flow], counted: dict[str, float]) -> Iterator[Row]:
    name = f"hackrf_like_odom_10hz_{way}"
    late_ms = np.array([each for flow in flows for each in flow.latencies_ms()])
    sent = sum(len(flow.sent) for flow in flows)
    least_ms = 1e3 * (TURNAROUND_S + (IN_FLIGHT + 1) * TRANSFER / RATE_HZ / OVERSAMPLING)
    note = "least: turnaround, the driver's transfers in flight, and the message's own transfer"
    for label, share in (("p50", 0.5), ("p99", 0.99)):
        value = float(np.quantile(late_ms, share)) if len(late_ms) else float("inf")
        yield Row(f"{name}_{label}_ms", value, "ms", None, "less", len(late_ms),
                  {"least": least_ms}, note=note)  # fmt: skip
    yield Row(f"{name}_pdr", len(late_ms) / sent, "ratio", None, "more", sent, counted,
              note="both radios' counters since their start")  # fmt: skip


def _play(robots: Pair, seed: int, robot: int, messages: list[bytes]) -> Flow:
    """Send messages, the first ones as a warm-up, and listen at the other robot."""
    flow = Flow()
    other = next(each for each in ROBOTS if each != robot)
    begin = time.monotonic() + np.random.default_rng(seed + robot).uniform(0, PERIOD_S)
    with (
        Subscriber(f"/rx_robot_{robot}/odom", runtime_dir=robots.folders[other]) as ear,
        Publisher(robots.folders[robot]) as out,
    ):
        for i, cdr in enumerate(messages):
            flow.listen(ear, begin + i * PERIOD_S)
            now_ns = time.time_ns()
            stamp = struct.pack("<iI", *divmod(now_ns, 10**9))
            if i >= WARM_UP:
                flow.sent[stamp] = now_ns
            out.send(f"/robot_{robot}/odom", cdr[: STAMP.start] + stamp + cdr[STAMP.stop :])
        end = time.monotonic() + DRAIN_S
        while time.monotonic() < end and not flow.is_complete:
            flow.listen(ear, time.monotonic() + LOOK_S)
    return flow


def _odometry(robot: int, seed: int) -> list[bytes]:
    """Odometry of a robot that drives around, as many messages as are needed at most."""
    driven = BuiltInRobot(f"robot_{robot}", (WARM_UP + MESSAGES) / ODOM_HZ, seed)
    return [each.cdr for each in driven.messages() if each.topic.endswith("/odom")]
