"""A full air both ways: one daemon sends nearly all that QPSK 1/2 carries, and hears all of it."""

import threading
import time
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks import daemons
from benchmarks.realtime.slice import take_short_slice
from benchmarks.realtime.traffic import CDR, LOOK_S, READY_S, undisturbed
from benchmarks.realtime.turns import Run
from sdrlinkd.client import ControlClient, Publisher, Subscriber
from sdrlinkd.family import family_cpu_s

SIZE = 900
BITS_PER_SAMPLE = 0.6
"""What QPSK 1/2 carries: 48 bits in the 80 samples of a symbol."""
OFFERED = 0.85
"""Share of that which is offered, in bytes of messages."""
EACH_S = 0.002
"""The producer sends what is due this often."""
WARM_UP_S = 1.0
SECONDS, QUICK_S = 8.0, 3.0
CONFIG = """[channel]
snr_db = 15
clock_ppm = 10
[modem]
rate_hz = {rate}
"""


class Look(NamedTuple):
    """Counters at one moment."""

    at: float
    sent: int
    heard: int
    samples_lost: int
    cpu_s: float


def lost_samples(tree: Path, seed: int, quick: bool) -> Run:
    """Samples that the receiver loses at 10 Msps."""
    return _run("loopback_10msps_lost_samples", "samples_lost", 10e6, tree, seed, quick)


def carried_share(tree: Path, seed: int, quick: bool) -> Run:
    """Share of the offered messages that arrive at 20 Msps."""
    return _run("loopback_20msps_carried_share", "carried", 20e6, tree, seed, quick)


def _run(name: str, what: str, rate_hz: float, tree: Path, seed: int, quick: bool) -> Run:
    counts = {"sent": 0, "heard": 0}
    stop, ready = threading.Event(), threading.Event()
    config = CONFIG.format(rate=rate_hz)
    with (
        daemons.running("loopback", (1,), ("load",), config, "", tree=tree) as these,
        undisturbed(), ThreadPoolExecutor(2) as pool, ControlClient(these.folders[1]) as control,
    ):  # fmt: skip
        look = partial(_look, control, these.processes[0].pid, counts)
        ear = pool.submit(_listen, these.folders[1], counts, ready, stop)
        try:
            ready.wait(READY_S)
            start = look()
            source = pool.submit(_produce, these.folders[1], rate_hz, seed, counts, stop)
            time.sleep(WARM_UP_S)
            first = look()
            time.sleep(QUICK_S if quick else SECONDS)
            last = look()
        finally:
            stop.set()
        source.result()
        ear.result()
    # From the first message on, so that no backlog of the warm-up counts as carried.
    sent, heard, lost = last.sent, last.heard, last.samples_lost - start.samples_lost
    cpu_pct = 100 * (last.cpu_s - first.cpu_s) / (last.at - first.at)
    values = {"samples_lost": float(lost), "carried": heard / max(1, sent)}
    note = f"{heard} of {sent} messages in time, {lost} samples lost, {cpu_pct:.0f} % of a core"
    return Run({name: values[what]}, sent, note)


def _look(control: ControlClient, pid: int, counts: dict[str, int]) -> Look:
    counters = control.ask("status")["carrier"]["counters"]
    return Look(
        time.monotonic(), counts["sent"], counts["heard"], int(counters["samples_lost"]),
        family_cpu_s(pid),
    )  # fmt: skip


def _produce(
    folder: Path, rate_hz: float, seed: int, counts: dict[str, int], stop: threading.Event
) -> None:
    take_short_slice()
    per_s = OFFERED * BITS_PER_SAMPLE * rate_hz / 8 / SIZE
    payload = CDR + np.random.default_rng(seed).bytes(SIZE - len(CDR))
    with Publisher(folder) as out:
        begin = time.monotonic()
        while not stop.is_set():
            for _ in range(int((time.monotonic() - begin) * per_s) - counts["sent"]):
                out.send("/robot_1/load", payload)
                counts["sent"] += 1
            time.sleep(EACH_S)


def _listen(
    folder: Path, counts: dict[str, int], ready: threading.Event, stop: threading.Event
) -> None:
    take_short_slice()
    with Subscriber("/rx_robot_1/load", runtime_dir=folder, depth=0) as ear:
        ready.set()
        while not stop.is_set():
            counts["heard"] += ear.receive(LOOK_S) is not None
