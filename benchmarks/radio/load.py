"""A radio like a USRP under full load: both robots send all the time, and each hears the other."""

import math
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.peers.radio import bare
from benchmarks.processes import Stolen
from benchmarks.radio.pair import ROBOTS, Look, pair
from benchmarks.report import Row
from sdrlinkd.client import ControlClient, Publisher, Subscriber

RATES_MSPS = (1, 2, 5, 10)
SURE_MSPS = 5
"""The highest rate that any machine is expected to sustain."""
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


class Times(NamedTuple):
    """Duration of the measurement at each rate."""

    warm_up_s: float
    measured_s: float
    peer_s: float


WHOLE, QUICK = Times(2.0, 20.0, 5.0), Times(1.0, 4.0, 0.5)


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


def rows(seed: int, quick: bool) -> Iterator[Row]:
    """The four rows of each rate."""
    times = QUICK if quick else WHOLE
    threads = bare.lost_in_threads(RATES_MSPS, times.peer_s)
    flowgraphs = {} if quick else bare.flowgraph_cpu_pct(RATES_MSPS, times.peer_s)
    for msps in RATES_MSPS:
        spans = under_load(1e6 * msps, times, seed)
        lost = {name: of[msps] for name, of in threads.items()}
        yield from _rows_of(msps, spans, lost, flowgraphs.get(msps))


def under_load(rate_hz: float, times: Times, seed: int) -> list[Span]:
    """Measure the load of each robot. Raises PeerError."""
    with (
        pair("usrp", ["load"], CONFIG.format(rate=rate_hz), more=DEVICE) as robots,
        _busy(robots.folders, rate_hz, seed),
    ):
        time.sleep(times.warm_up_s)
        first, stolen = [robots.look(robot) for robot in ROBOTS], Stolen()
        time.sleep(times.measured_s)
        last, stolen_pct = [robots.look(robot) for robot in ROBOTS], stolen.pct()
    return [Span(*each, stolen_pct) for each in zip(first, last, strict=True)]


def _rows_of(
    msps: int, spans: list[Span], lost_a_s: dict[str, float], flowgraph: float | None
) -> Iterator[Row]:
    name = f"usrp_like_{msps}msps"
    target = 0.0 if msps <= SURE_MSPS else None
    rate_hz, one = 1e6 * msps, spans[0]
    on_air = min(span.count("samples_sent") / span.seconds / rate_hz for span in spans)
    sent, heard, bursts = (
        sum(span.link(*of) for span in spans)
        for of in (("tx", "pdus_sent"), ("rx", "pdus_heard"), ("tx", "bursts_sent"))
    )
    lost, underflows, late = (
        sum(span.count(each) for span in spans) for each in ("samples_lost", "underflows", "late")
    )
    note = f"both robots, {one.seconds:.1f} s; {heard} PDUs heard of {sent}"
    yield Row(f"{name}_lost_samples", lost, "samples", target, "less",
              round(rate_hz * sum(span.seconds for span in spans)),
              {"machine_stolen_pct": one.stolen_pct}
              | {each: a_second * one.seconds for each, a_second in lost_a_s.items()},
              note=f"{note}; {bare.THREADS}")  # fmt: skip
    yield Row(f"{name}_underflows", underflows, "bursts", target, "less", bursts,
              {"late": late, "on_air_pct": 100 * on_air}, note=note)  # fmt: skip
    for part, peers in (
        ("daemon", {}), ("radio_process", {} if flowgraph is None else {"gnu_radio": flowgraph})
    ):  # fmt: skip
        yield Row(f"{name}_{part}_cpu_pct", one.cpu_pct(part), "%", None, "less",
                  round(one.seconds), peers, note=NOTES[part])  # fmt: skip


NOTES = {
    "daemon": "of one core, user and system, robot 1's daemon and modem; trials: seconds",
    "radio_process": "of one core, user and system, robot 1's radio process with the test radio's "
    "driver, which simulates converters and air; gnu_radio: source and sink alone, no bursts, with "
    "the same driver; trials: seconds",
}


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
