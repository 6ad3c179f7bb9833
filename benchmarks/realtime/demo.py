"""The built-in robot's messages in PDUs of 64 B, as `sdrlinkctl demo --link ofdm` sends them."""

import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.absent import PeerError
from benchmarks.daemons import daemon_at_work
from benchmarks.realtime.slice import take_short_slice
from benchmarks.realtime.traffic import DRAIN_S, LOOK_S, READY_S, undisturbed
from benchmarks.realtime.turns import Run
from sdrlinkd.adapters import paced
from sdrlinkd.client import Publisher, Subscriber
from sdrlinkd.demo import Options, Sample, Source, Trace, open_source, write_config

SECONDS, QUICK_S = 15.0, 4.0


def demo(tree: Path, seed: int, quick: bool) -> Run:
    """The latency of all messages; a lost one is infinitely late. Raises PeerError if all are."""
    source = open_source(None, None, [], QUICK_S if quick else SECONDS, seed)
    trace = Trace({topic.name: topic.type for topic in source.registry.topics})
    with TemporaryDirectory(prefix="benchmark-") as name:
        folder = Path(name)
        options = Options(link="ofdm", seed=seed)
        config = write_config(folder / "node", source, options, "both", folder)
        with daemon_at_work(config, tree) as sockets:
            _play(sockets, source, trace)
    late_ms = [1e3 * (heard.at - sent.at) for sent, heard in trace.all_pairs()]
    if not late_ms:
        raise PeerError("no message arrived")
    lost = trace.n_sent - len(late_ms)
    p50, p99 = np.quantile([*late_ms, *[np.inf] * lost], [0.5, 0.99], method="nearest")
    return Run({"demo_p99_ms": float(p99)}, trace.n_sent, f"p50 {p50:.2f} ms; {lost} lost")


def _play(folder: Path, source: Source, trace: Trace) -> None:
    ready, ended = threading.Event(), threading.Event()
    with undisturbed(), ThreadPoolExecutor(2) as pool:
        ear = pool.submit(_listen, folder, trace, ready, ended)
        try:
            ready.wait(READY_S)
            pool.submit(_produce, folder, source, trace).result()
            deadline = time.monotonic() + DRAIN_S
            while time.monotonic() < deadline and trace.n_received < trace.n_sent:
                time.sleep(LOOK_S)
        finally:
            ended.set()
        ear.result()


def _produce(folder: Path, source: Source, trace: Trace) -> None:
    take_short_slice()
    # Made beforehand, as serializing takes time in this process.
    messages = list(source.messages())
    with Publisher(folder, checked=False) as out:
        for message in paced(messages, 1.0):
            trace.sent[_topic(message.topic)].append(Sample(time.monotonic(), message.cdr))
            out.send(message.topic, message.cdr, type=message.type)


def _listen(folder: Path, trace: Trace, ready: threading.Event, ended: threading.Event) -> None:
    take_short_slice()
    with Subscriber("/rx_robot_1/*", runtime_dir=folder, depth=0) as ear:
        ready.set()
        while not ended.is_set():
            message = ear.receive(LOOK_S)
            if message is not None:
                heard = Sample(time.monotonic(), message.payload)
                trace.received[_topic(message.topic)].append(heard)


def _topic(name: str) -> str:
    """The registry's name of a topic on the bus."""
    return name.rpartition("/")[2]
