"""A radio like a USRP under full load: two robots send all the time, and each hears the other."""

import math
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.processes import Stolen
from benchmarks.radio_pair import ROBOTS, Look, pair
from sdrlinkd.client import ControlClient, Publisher, Subscriber

REFILL_S = 0.25
AHEAD_S = 1.0
"""Least airtime of queued messages, which keeps the transmitter busy."""
BITS_PER_SAMPLE = 0.65
"""More than the rate of QPSK 1/2."""
SIZE = 8192
CDR = b"\0\1\0\0" + bytes(8) + SIZE.to_bytes(4, "little")
DEVICE = f",rxbuf={256 * 2040}"
"""The effect of `num_recv_frames = 256` of etc/radios/usrp.toml on a USRP with USB."""
CONFIG = """[modem]
rate_hz = {rate}
frequency_hz = 915e6
[topic.load]
qos = "bulk"
"""


@dataclass(frozen=True)
class Span:
    """One robot between two readings."""

    first: Look
    last: Look
    stolen_pct: float
    """Share of the machine's time that others used."""

    @property
    def seconds(self) -> float:
        """Length of the span in s."""
        return self.last.at - self.first.at

    def count(self, name: str) -> int:
        """Growth of a counter of its PDU link."""
        return self.last.counter(name) - self.first.counter(name)

    def cpu_pct(self, part: str) -> float:
        """CPU time of `daemon` or `radio_process`, in % of one core."""
        return 100 * (self.last.cpu_s[part] - self.first.cpu_s[part]) / self.seconds

    def link(self, way: str, name: str) -> int:
        """Growth of a counter of its link, such as `tx` `pdus_sent`."""
        return int(self.last.status["link"][way][name] - self.first.status["link"][way][name])


def under_load(rate_hz: float, warm_up_s: float, measured_s: float, seed: int) -> list[Span]:
    """Measure each robot for `measured_s`. Raises PeerError."""
    with (
        pair("usrp", ["load"], CONFIG.format(rate=rate_hz), more=DEVICE) as robots,
        _busy(robots.folders, rate_hz, seed),
    ):
        time.sleep(warm_up_s)
        first, stolen = [robots.look(robot) for robot in ROBOTS], Stolen()
        time.sleep(measured_s)
        last, stolen_pct = [robots.look(robot) for robot in ROBOTS], stolen.pct()
    return [Span(*each, stolen_pct) for each in zip(first, last, strict=True)]


@contextmanager
def _busy(folders: dict[int, Path], rate_hz: float, seed: int) -> Iterator[None]:
    """Give every robot constant traffic, and a consumer for what it hears."""
    stop = threading.Event()
    threads = []
    for robot, folder in folders.items():
        payload = CDR + np.random.default_rng(seed + robot).bytes(SIZE)
        threads += [
            threading.Thread(target=_refill, args=(robot, folder, payload, rate_hz, stop)),
            threading.Thread(target=_consume, args=(folder, stop)),
        ]
    for thread in threads:
        thread.start()
    try:
        yield
    finally:
        stop.set()
        for thread in threads:
            thread.join()


def _refill(
    robot: int, folder: Path, payload: bytes, rate_hz: float, stop: threading.Event
) -> None:
    wanted = (AHEAD_S + REFILL_S) * rate_hz * BITS_PER_SAMPLE / 8
    with Publisher(folder) as out, ControlClient(folder) as control:
        while not stop.is_set():
            queued = control.ask("status")["link"]["tx"]["queued_bytes"]
            for _ in range(max(0, math.ceil((wanted - queued) / SIZE))):
                out.send(f"/robot_{robot}/load", payload)
            stop.wait(REFILL_S)


def _consume(folder: Path, stop: threading.Event) -> None:
    with Subscriber("*", runtime_dir=folder) as heard:
        while not stop.is_set():
            heard.receive(REFILL_S)
