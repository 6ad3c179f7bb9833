"""A radio like a USRP under full load: both robots send all the time, each hears the other."""

import math
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.radio import bare
from benchmarks.radio.pair import ROBOTS, Look, pair
from benchmarks.report import Row
from sdrlinkd.client import ControlClient, Publisher, Subscriber

RATES_MSPS = (1, 2, 5, 10)
SURE_MSPS = 5
"""Beyond that, no machine is promised to keep up."""
SECONDS, QUICK_S = 20.0, 4.0
WARM_UP_S = 2.0
REFILL_S = 0.25
AHEAD_S = 1.0
"""Of the air's time, at least, waits while the transmitter is kept busy."""
BITS_PER_SAMPLE = 0.65
"""QPSK 1/2, and more than it."""
SIZE = 8192
CDR = b"\0\1\0\0" + bytes(8) + SIZE.to_bytes(4, "little")
CONFIG = """[modem]
rate_hz = {rate}
frequency_hz = 915e6
[topic.load]
qos = "bulk"
"""


@dataclass(frozen=True)
class Span:
    """One robot between two looks."""

    first: Look
    last: Look

    @property
    def seconds(self) -> float:
        """How long."""
        return self.last.at - self.first.at

    def count(self, name: str) -> int:
        """What a counter of its carrier has grown by."""
        return self.last.counter(name) - self.first.counter(name)

    def link(self, way: str, name: str) -> int:
        """The same of the link's."""
        return int(self.last.status["link"][way][name] - self.first.status["link"][way][name])


def rows(seed: int, quick: bool) -> Iterator[Row]:
    """Four of each rate."""
    seconds = QUICK_S if quick else SECONDS
    for msps in RATES_MSPS:
        yield from _rows_of(msps, under_load(1e6 * msps, seconds, seed), bare.peers(msps, seconds))


def under_load(rate_hz: float, seconds: float, seed: int) -> list[Span]:
    """Of each robot. Raises PeerError."""
    with (
        pair("usrp", "load", CONFIG.format(rate=rate_hz)) as robots,
        _busy(robots.folders, rate_hz, seed),
    ):
        time.sleep(WARM_UP_S)
        first = [robots.look(robot) for robot in ROBOTS]
        time.sleep(seconds)
        last = [robots.look(robot) for robot in ROBOTS]
    return [Span(*each) for each in zip(first, last, strict=True)]


def _rows_of(msps: int, spans: list[Span], threads: dict[str, float]) -> Iterator[Row]:
    name = f"usrp_like_{msps}msps"
    target = 0.0 if msps <= SURE_MSPS else None
    rate_hz, one = 1e6 * msps, spans[0]
    seconds = sum(span.seconds for span in spans)
    on_air_pct = 100 * min(span.count("samples_sent") / span.seconds / rate_hz for span in spans)
    heard = sum(span.link("rx", "pdus_heard") for span in spans)
    sent = sum(span.link("tx", "pdus_sent") for span in spans)
    bursts = sum(span.link("tx", "bursts_sent") for span in spans)
    note = f"{one.seconds:.1f} s, both robots; {on_air_pct:.1f} % of it on the air"
    yield Row(f"{name}_lost_samples", sum(span.count("samples_lost") for span in spans), "samples",
              target, "less", round(rate_hz * seconds), threads,
              note=f"{note}; {heard} of {sent} PDUs heard; {bare.NOTE}")  # fmt: skip
    yield Row(f"{name}_underflows", sum(span.count("underflows") for span in spans), "bursts",
              target, "less", bursts, {"late": sum(span.count("late") for span in spans),
                                       "on_air_pct": on_air_pct}, note=note)  # fmt: skip
    for part, cpu_s in (
        ("daemon", one.last.daemon_cpu_s - one.first.daemon_cpu_s),
        ("radio_process", one.last.radio_cpu_s - one.first.radio_cpu_s),
    ):
        yield Row(f"{name}_{part}_cpu_pct", 100 * cpu_s / one.seconds, "%", None, "less",
                  round(one.seconds), note=NOTES[part])  # fmt: skip


NOTES = {
    "daemon": "of one core, user and system, in s of robot 1's daemon",
    "radio_process": "of one core, user and system, in s of robot 1's radio process, the test "
    "radio's driver with it: what converters, filters and air would do elsewhere",
}


@contextmanager
def _busy(folders: dict[int, Path], rate_hz: float, seed: int) -> Iterator[None]:
    """Every robot always has something to send, and a consumer for what it hears."""
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
    with Subscriber("*", directory=folder) as heard:
        while not stop.is_set():
            heard.receive(REFILL_S)
