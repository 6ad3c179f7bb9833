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


class Kept:
    """What one daemon says, on its way into the file."""

    def __init__(self, directory: Path, writer: DriveWriter, patterns: Sequence[str]) -> None:
        self._writer = writer
        self._patterns = patterns
        self._health = Health()
        self._robot: int | None = None
        self._status_at = 0
        self._level = ""
        self.watch = DaemonWatch(directory, self._see, self._take, self._wants)

    def _wants(self, topic: str, kind: str) -> bool:
        return kind in PLACES or any(fnmatch.fnmatchcase(topic, each) for each in self._patterns)

    def _see(self, snapshot: Snapshot | None) -> None:
        now = time.time_ns()
        if snapshot is None:
            if self._level and self._robot is not None:
                self._say(self._robot, "error", "the daemon does not answer", now)
                self._level = ""
            return
        if now < self._status_at + STATUS_NS:
            return
        self._robot, self._status_at = snapshot.node, now
        self._writer.status(snapshot, now)
        verdict = snapshot.verdict
        if verdict.level != self._level:
            level = "info" if verdict.level == "OK" else "warning"
            self._say(snapshot.node, level, ": ".join([verdict.level, *verdict.reasons[:1]]), now)
            self._level = verdict.level
        for line in self._health.look(snapshot):
            self._say(snapshot.node, line.level.value, line.text, now)

    def _say(self, robot: int, level: str, text: str, now: int) -> None:
        self._writer.event(Event(robot, level, text), now)

    def _take(self, source: Source, cdr: bytes) -> None:
        if self._robot is None:
            return
        topic = sent(source.robot, source.topic)
        if not source.is_sent:
            topic = received(self._robot, source.robot, source.topic)
        self._writer.message(topic, source.kind, cdr, time.time_ns())


async def keep(
    directories: Sequence[Path], writer: DriveWriter, patterns: Sequence[str],
    progress: Callable[[], None],
) -> None:  # fmt: skip
    """Keep what the daemons in `directories` say, until cancelled.

    That are their reports once a second, events, the messages that say where robots are, and those
    of topics that match a pattern. `progress` is called once a second.
    """
    async with asyncio.TaskGroup() as group:
        for each in directories:
            group.create_task(Kept(each, writer, patterns).watch.run())
        while True:
            await asyncio.sleep(SYNC_S)
            writer.sync()
            progress()
