"""One run: a real daemon, a producer, a consumer, and the clock between them."""

import contextlib
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import msgspec

from sdrlinkd.adapters import paced
from sdrlinkd.client import ControlClient, NoDaemonError, Publisher, Subscriber
from sdrlinkd.demo.report import RunResult, run_result
from sdrlinkd.demo.source import Source
from sdrlinkd.demo.trace import Sample, Trace
from sdrlinkd.errors import UserError
from sdrlinkd.reports import Snapshot

START_TIMEOUT_S = 30.0
QUIET_S = 3.0
NODE_ID = 1

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Options:
    """What a run may be told."""

    link: str
    pdu_size: int
    speed: float
    seed: int


def run_demo(source: Source, options: Options, progress: Progress) -> tuple[RunResult, Trace]:
    """Send `source` through a daemon and back; its figures, and the samples behind them.

    `progress(sent, received)` is called as the run goes on.
    """
    trace = Trace({topic.name: topic.type for topic in source.registry.topics})
    with tempfile.TemporaryDirectory(prefix="sdrlink-") as folder:
        directory = Path(folder)
        config = _write_config(directory, source, options)
        with _daemon(config, directory), _Consumer(directory, trace) as consumer:
            started_at = time.monotonic()
            _produce(
                source, options, directory, trace, lambda: progress(trace.n_sent, consumer.count)
            )
            snapshot = _wait_until_through(directory, trace, consumer, progress)
            duration_s = time.monotonic() - started_at
            problems = _check(directory)
    link = snapshot.link
    dropped = {**link.tx.dropped, **link.rx.dropped}
    pdus = {k: v for k, v in link.rx.pdus_dropped.items() if k not in ("rx_control", "rx_dup")}
    result = run_result(
        trace,
        name=options.link,
        source=source.title,
        seed=options.seed,
        pdu_size=options.pdu_size,
        duration_s=duration_s,
        pdus_sent=link.tx.pdus_sent,
        entries=link.tx.entries,
        ledger_adds_up=not problems,
        dropped={**dropped, **pdus},
        left_out=source.left_out,
        damage=source.recording.damage,
    )
    return result, trace


def _write_config(directory: Path, source: Source, options: Options) -> Path:
    (directory / "registry.csv").write_text(source.registry.csv())
    # Entry ids rest for the reassembly timeout, so faster play needs a shorter one.
    timeout_s = min(0.5, 0.5 / options.speed)
    path = directory / "sdrlinkd.toml"
    path.write_text(
        f'namespace = "{source.namespace}"\nrobot_id = {NODE_ID}\nseed = {options.seed}\n'
        f"rx_depth = 0\n"
        f"[link]\npdu_size = {options.pdu_size}\n"
        f"[reassembly]\ntimeout_s = {max(timeout_s, 0.02)}\n"
        f'[bus]\nruntime_dir = "{directory}"\n'
    )
    return path


@contextlib.contextmanager
def _daemon(config: Path, directory: Path) -> Iterator[None]:
    """A daemon of its own process; its log is shown only when it fails."""
    log_path = directory / "log"
    with log_path.open("w") as log_file:
        process = subprocess.Popen(
            [sys.executable, "-m", "sdrlinkd", "--config", str(config)],
            stdout=log_file,
            stderr=log_file,
        )
    try:
        _wait_until_up(process, directory, log_path)
        yield
    finally:
        process.terminate()
        try:
            process.wait(timeout=10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def _wait_until_up(process: subprocess.Popen[bytes], directory: Path, log_path: Path) -> None:
    deadline = time.monotonic() + START_TIMEOUT_S
    while process.poll() is None and time.monotonic() < deadline:
        with contextlib.suppress(NoDaemonError), ControlClient(directory, timeout_s=0.5) as control:
            control.ask("hello")
            return
    raise UserError(f"the daemon did not start:\n{log_path.read_text().strip()}")


class _Consumer(threading.Thread):
    """Takes what the daemon republishes, on a thread of its own."""

    def __init__(self, directory: Path, trace: Trace) -> None:
        super().__init__(name="consumer", daemon=True)
        self._prefix = f"/rx_robot_{NODE_ID}/"
        self._trace = trace
        self._subscriber = Subscriber(self._prefix + "*", directory=directory, depth=0)
        self._done = threading.Event()
        self.count = 0
        self.last_at = 0.0

    def run(self) -> None:
        while not self._done.is_set():
            message = self._subscriber.receive(timeout_s=0.1)
            if message is not None:
                self.last_at = time.monotonic()
                name = message.topic.removeprefix(self._prefix)
                self._trace.received[name].append(Sample(self.last_at, message.payload))
                self.count += 1

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._done.set()
        self.join()
        self._subscriber.close()


def _produce(
    source: Source, options: Options, directory: Path, trace: Trace, progress: Callable[[], None]
) -> None:
    prefix = f"/{source.namespace}/" if source.namespace else "/"
    with Publisher(directory) as publisher:
        for message in paced(source.messages(), options.speed):
            name = message.topic.removeprefix(prefix)
            trace.sent[name].append(Sample(time.monotonic(), message.cdr))
            publisher.send(message.topic, message.cdr, type=message.type)
            progress()


def _wait_until_through(
    directory: Path, trace: Trace, consumer: _Consumer, progress: Progress
) -> Snapshot:
    """Until nothing is queued, in flight or held any more, or nothing moves for a while."""
    last_moved_at = time.monotonic()
    last_seen = (-1, -1)
    with ControlClient(directory) as control:
        while True:
            snapshot = msgspec.convert(control.ask("status"), Snapshot)
            tx, rx = snapshot.link.tx, snapshot.link.rx
            progress(trace.n_sent, consumer.count)
            taken = snapshot.bus.received == trace.n_sent
            if (
                taken
                and not (tx.queued or tx.in_flight or rx.held)
                and consumer.count == rx.delivered
            ):
                return snapshot
            seen = (tx.sent, consumer.count)
            if seen != last_seen:
                last_seen, last_moved_at = seen, time.monotonic()
            elif time.monotonic() - last_moved_at > QUIET_S:
                return snapshot
            time.sleep(0.02)


def _check(directory: Path) -> list[str]:
    with ControlClient(directory) as control:
        problems: list[str] = control.ask("check")["problems"]
        return problems
