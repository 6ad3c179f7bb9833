"""One run: real daemons, a producer, a consumer, and the clock between them."""

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from sdrlinkd.adapters import paced
from sdrlinkd.client import Publisher
from sdrlinkd.demo.links import Options, write_config
from sdrlinkd.demo.nodes import Consumer, daemon, problems_of, snapshot_of
from sdrlinkd.demo.report import RunResult, run_result
from sdrlinkd.demo.source import Source
from sdrlinkd.demo.trace import Sample, Trace
from sdrlinkd.reports import Snapshot

# Nothing has moved for so long: what is missing will not come.
QUIET_S = 3.0
# Nothing is on its way any more; what is in the receiver comes within this.
SETTLE_S = 0.3

Progress = Callable[[int, int], None]


def run_demo(source: Source, options: Options, progress: Progress) -> tuple[RunResult, Trace]:
    """Send `source` through daemons; its figures, and the samples behind them.

    `progress(sent, received)` is called as the run goes on.
    """
    trace = Trace({topic.name: topic.type for topic in source.registry.topics})
    with tempfile.TemporaryDirectory(prefix="sdrlink-") as folder:
        if options.link == "iqfile":
            sent, heard, duration_s, problems = _over_recording(
                Path(folder), source, options, trace, progress
            )
        else:
            sent, duration_s, problems = _to_itself(Path(folder), source, options, trace, progress)
            heard = sent
    result = run_result(
        trace,
        source=source,
        options=options,
        duration_s=duration_s,
        sender=sent,
        receiver=heard,
        ledger_adds_up=not problems,
    )
    return result, trace


def _to_itself(
    folder: Path, source: Source, options: Options, trace: Trace, progress: Progress
) -> tuple[Snapshot, float, list[str]]:
    """One node that hears itself: (its snapshot, duration in s, problems of the ledger)."""
    config = write_config(folder / "node", source, options, "both", folder)
    directory = config.parent
    with daemon(config), Consumer(directory, trace) as consumer:
        began = time.monotonic()
        _produce(source, options, directory, trace, lambda: progress(trace.n_sent, consumer.count))
        snapshot = _wait_until_through(
            directory, consumer, trace.n_sent, lambda: progress(trace.n_sent, consumer.count)
        )
        duration_s = max(consumer.last_at, trace.last_sent_at) - began
        return snapshot, duration_s, problems_of(directory)


def _over_recording(
    folder: Path, source: Source, options: Options, trace: Trace, progress: Progress
) -> tuple[Snapshot, Snapshot, float, list[str]]:
    """A node that records, then one that plays: (both snapshots, duration in s, problems)."""
    recording = options.recording or folder / "recording"
    config = write_config(folder / "sender", source, options, "record", recording.absolute())
    with daemon(config):
        began = time.monotonic()
        _produce(source, options, config.parent, trace, lambda: progress(trace.n_sent, 0))
        sent = _wait_until_through(config.parent, None, trace.n_sent, lambda: None)
        duration_s = time.monotonic() - began
        problems = problems_of(config.parent)
    config = write_config(folder / "listener", source, options, "play", recording.absolute())
    with daemon(config), Consumer(config.parent, trace, by_age=True) as consumer:
        heard = _wait_until_through(
            config.parent, consumer, 0, lambda: progress(trace.n_sent, consumer.count)
        )
        problems += problems_of(config.parent)
    return sent, heard, duration_s, problems


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
    directory: Path, consumer: Consumer | None, n_sent: int, progress: Callable[[], None]
) -> Snapshot:
    """Until nothing is on its way any more, or nothing moves for a while."""
    moved_at = time.monotonic()
    seen: object = None
    while True:
        snapshot = snapshot_of(directory)
        progress()
        tx, rx, carrier = snapshot.link.tx, snapshot.link.rx, snapshot.carrier
        count = consumer.count if consumer else 0
        now_seen = (tx.sent, count, carrier.counters.get("samples") if not count else None)
        if now_seen != seen:
            seen, moved_at = now_seen, time.monotonic()
        still_s = time.monotonic() - moved_at
        done = (
            snapshot.bus.received == n_sent
            and not (tx.queued or tx.in_flight or rx.held)
            and (consumer is None or count == rx.delivered)
            and (carrier.state == "ended" or consumer is None or n_sent)
        )
        if (done and still_s > SETTLE_S) or (still_s > QUIET_S and carrier.state != "up"):
            return snapshot
        if still_s > QUIET_S and n_sent:
            return snapshot
        time.sleep(0.02)
