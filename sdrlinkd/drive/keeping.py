"""Keeps a drive while it happens."""

import asyncio
import fnmatch
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from sdrlinkd.adapters import PLACES
from sdrlinkd.daemon_watch import DaemonWatch, Source
from sdrlinkd.drive.names import Event, received, sent
from sdrlinkd.drive.writer import DriveWriter
from sdrlinkd.health import Health
from sdrlinkd.reports import Snapshot

SYNC_S = 1.0
STATUS_NS = 900_000_000
"""Least time in ns between two reports of a daemon that are kept."""


class Chronicle:
    """Writes what one daemon reports, and in sentences what changes."""

    def __init__(self, writer: DriveWriter) -> None:
        self._writer = writer
        self._health = Health()
        self.robot: int | None = None
        """Id of the daemon's robot; None before its first report."""
        self._status_at = 0
        self._last: tuple[Snapshot, int] | None = None
        self._level = ""

    def see(self, snapshot: Snapshot | None, now_ns: int) -> None:
        """Take a report, or None while the daemon is away."""
        if snapshot is None:
            if self._level:
                self._say("error", "the daemon does not answer", now_ns)
                self._level = ""
            return
        if now_ns < self._status_at + STATUS_NS:
            self._last = snapshot, now_ns
            return
        self._last = None
        self.robot, self._status_at = snapshot.node, now_ns
        self._writer.status(snapshot, now_ns)
        verdict = snapshot.verdict
        if verdict.level != self._level:
            level = "info" if verdict.level == "OK" else "warning"
            self._say(level, ": ".join([verdict.level, *verdict.reasons[:1]]), now_ns)
            self._level = verdict.level
        for line in self._health.look(snapshot):
            self._say(line.level.name.lower(), line.text, now_ns)

    def end(self) -> None:
        """Write the last report, if it came too soon after the one before."""
        if self._last is not None:
            self._writer.status(*self._last)
            self._last = None

    def _say(self, level: str, text: str, now_ns: int) -> None:
        if self.robot is not None:
            self._writer.event(Event(self.robot, level, text), now_ns)


class _Kept:
    """What one daemon says, on its way into the file."""

    def __init__(self, directory: Path, writer: DriveWriter, patterns: Sequence[str]) -> None:
        self._writer = writer
        self._patterns = patterns
        self.chronicle = Chronicle(writer)
        self.watch = DaemonWatch(
            directory,
            lambda snapshot: self.chronicle.see(snapshot, time.time_ns()),
            self._take,
            self._wants,
        )

    def _wants(self, topic: str, kind: str) -> bool:
        return kind in PLACES or any(fnmatch.fnmatchcase(topic, each) for each in self._patterns)

    def _take(self, source: Source, cdr: bytes) -> None:
        at = self.chronicle.robot
        if at is not None:
            is_sent, robot, topic = source.is_sent, source.robot, source.topic
            name = sent(robot, topic) if is_sent else received(at, robot, topic)
            self._writer.message(name, source.kind, cdr, time.time_ns())


async def keep(
    directories: Sequence[Path], writer: DriveWriter, patterns: Sequence[str],
    progress: Callable[[], None],
) -> None:  # fmt: skip
    """Keep what the daemons in `directories` say, until cancelled.

    That are their reports once a second, events, the messages that say where robots are, and those
    of topics that match a pattern. `progress` is called once a second.
    """
    kept = [_Kept(each, writer, patterns) for each in directories]
    try:
        async with asyncio.TaskGroup() as group:
            for each in kept:
                group.create_task(each.watch.run())
            while True:
                await asyncio.sleep(SYNC_S)
                writer.sync()
                progress()
    finally:
        for each in kept:
            each.chronicle.end()
