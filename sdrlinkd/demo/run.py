"""Runs the demonstration once: real daemons, a producer and a consumer on one clock."""

import time
from collections.abc import Callable
from pathlib import Path

from sdrlinkd.adapters import paced
from sdrlinkd.client import Publisher
from sdrlinkd.demo.folder import run_folder
from sdrlinkd.demo.links import Options, write_config
from sdrlinkd.demo.load import Load, LoadOf
from sdrlinkd.demo.nodes import Consumer, daemon, problems_of, snapshot_of
from sdrlinkd.demo.report import RunResult, phy_result, run_result
from sdrlinkd.demo.source import Source
from sdrlinkd.demo.trace import Sample, Trace
from sdrlinkd.reports import Snapshot

# Time in s without any progress after which missing messages are given up.
QUIET_S = 3.0
# Time in s for what is still in the receiver, once nothing is in transit.
SETTLE_S = 0.3

# Least time in s between two reports of a daemon.
LOOK_S = 0.9

Progress = Callable[[int, int], None]
See = Callable[[Snapshot], None]


def run_demo(
    source: Source, options: Options, progress: Progress, see: See = lambda _snapshot: None
) -> tuple[RunResult, Trace]:
    """Send `source` through daemons; returns the results, and the trace behind them.

    `progress(sent, received)` is called during the run, and `see` with reports of the daemons.
    """
    trace = Trace({topic.name: topic.type for topic in source.registry.topics})
    with run_folder() as folder:
        if options.link == "iqfile":
            sent, heard, duration_s, problems = _over_recording(
                folder, source, options, trace, progress, see
            )
            load = None
        else:
            sent, duration_s, problems, load = _to_itself(
                folder, source, options, trace, progress, see
            )
            heard = sent
    tx, rx = sent.link.tx, heard.link.rx
    pdus = {k: v for k, v in rx.pdus_dropped.items() if k not in ("rx_control", "rx_dup")}
    result = run_result(
        trace,
        source=source,
        options=options,
        duration_s=duration_s,
        pdus_sent=tx.pdus_sent,
        entries=tx.entries,
        dropped={**tx.dropped, **rx.dropped, **pdus},
        ledger_adds_up=not problems,
        phy=None if options.link == "direct" else phy_result(options, heard, load),
    )
    return result, trace


def _to_itself(
    folder: Path, source: Source, options: Options, trace: Trace, progress: Progress, see: See
) -> tuple[Snapshot, float, list[str], Load]:
    """Run one node that hears itself: (snapshot, duration in s, ledger discrepancies, load)."""
    config = write_config(folder / "node", source, options, "both", folder)
    directory = config.parent
    with daemon(config) as process, Consumer(directory, trace) as consumer:
        began, load, looks = time.monotonic(), LoadOf(process.pid), _Looks(directory, see)

        def go_on() -> None:
            progress(trace.n_sent, consumer.count)
            looks.look()

        _produce(source, options, directory, trace, go_on)
        snapshot = _wait_until_through(directory, consumer, trace.n_sent, go_on)
        see(snapshot)
        duration_s = max(consumer.last_at, trace.last_sent_at) - began
        return snapshot, duration_s, problems_of(directory), load.read()


def _over_recording(
    folder: Path, source: Source, options: Options, trace: Trace, progress: Progress, see: See
) -> tuple[Snapshot, Snapshot, float, list[str]]:
    """Run a node that records, then one that plays: (both snapshots, duration in s, problems)."""
    recording = options.recording or folder / "recording"
    config = write_config(folder / "sender", source, options, "record", recording.absolute())
    with daemon(config):
        began, looks = time.monotonic(), _Looks(config.parent, see)

        def go_on() -> None:
            progress(trace.n_sent, 0)
            looks.look()

        _produce(source, options, config.parent, trace, go_on)
        sent = _wait_until_sent(config.parent, trace.n_sent)
        see(sent)
        duration_s = time.monotonic() - began
        problems = problems_of(config.parent)
    config = write_config(folder / "listener", source, options, "play", recording.absolute())
    with daemon(config), Consumer(config.parent, trace, by_age=True) as consumer:
        heard = _wait_until_played(
            config.parent, consumer, lambda: progress(trace.n_sent, consumer.count)
        )
        see(heard)
        problems += problems_of(config.parent)
    return sent, heard, duration_s, problems


class _Looks:
    """Asks a daemon for its report about once a second."""

    def __init__(self, directory: Path, see: See) -> None:
        self._directory = directory
        self._see = see
        self._next_at = 0.0

    def look(self) -> None:
        """Ask, if it is time."""
        now = time.monotonic()
        if now >= self._next_at:
            self._next_at = now + LOOK_S
            self._see(snapshot_of(self._directory))


def _produce(
    source: Source, options: Options, directory: Path, trace: Trace, progress: Callable[[], None]
) -> None:
    prefix = f"/{source.namespace}/" if source.namespace else "/"
    with Publisher(directory, checked=False) as publisher:
        for message in paced(source.messages(), options.speed):
            name = message.topic.removeprefix(prefix)
            trace.sent[name].append(Sample(time.monotonic(), message.cdr))
            publisher.send(message.topic, message.cdr, type=message.type)
            progress()


def _wait_until_sent(directory: Path, n_sent: int) -> Snapshot:
    """Wait until all messages have left, or nothing moves for a while; returns the snapshot."""
    return _watch(
        directory,
        lambda at: at.bus.received == n_sent and not at.link.tx.queued and not at.link.tx.in_flight,
        lambda at: (at.bus.received, at.link.tx.sent),
    )


def _wait_until_through(
    directory: Path, consumer: Consumer, n_sent: int, progress: Callable[[], None]
) -> Snapshot:
    """Wait until no message is in transit, or nothing moves for a while; returns the snapshot."""

    def is_through(at: Snapshot) -> bool:
        progress()
        tx, rx = at.link.tx, at.link.rx
        on_its_way = tx.queued or tx.in_flight or rx.held
        return at.bus.received == n_sent and not on_its_way and consumer.count == rx.delivered

    return _watch(
        directory,
        is_through,
        lambda at: (at.bus.received, at.link.tx.sent, at.link.rx.pdus_heard, consumer.count),
    )


def _wait_until_played(
    directory: Path, consumer: Consumer, progress: Callable[[], None]
) -> Snapshot:
    """Wait until the recording is over and all its messages have come; returns the snapshot."""

    def is_over(at: Snapshot) -> bool:
        progress()
        rx = at.link.rx
        return at.carrier.state == "ended" and not rx.held and consumer.count == rx.delivered

    return _watch(directory, is_over, lambda at: (at.carrier.counters["samples"], consumer.count))


def _watch(
    directory: Path, is_done: Callable[[Snapshot], bool], moving: Callable[[Snapshot], object]
) -> Snapshot:
    """The snapshot once `is_done` holds and nothing moved for SETTLE_S, or else for QUIET_S."""
    seen: object = None
    still_since = time.monotonic()
    while True:
        snapshot = snapshot_of(directory)
        done = is_done(snapshot)
        now_seen = moving(snapshot)
        if now_seen != seen:
            seen, still_since = now_seen, time.monotonic()
        still_s = time.monotonic() - still_since
        if (done and still_s > SETTLE_S) or still_s > QUIET_S:
            return snapshot
        time.sleep(0.02)
