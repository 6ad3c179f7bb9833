"""Puts what one daemon says into the world."""

import time
from pathlib import Path

from sdrlinkd.daemon_watch import DaemonWatch, Source
from sdrlinkd.reports import Snapshot
from sdrlinkd.web.positions import PREFERENCE
from sdrlinkd.web.world import World

MOST_WAITING = 200
"""Positions that wait for this program; further ones are dropped."""


class DaemonFeed:
    """Follows the daemon at `directory` until `run` is cancelled."""

    def __init__(self, world: World, directory: Path) -> None:
        self._world = world
        self._key = str(directory)
        self._watch = DaemonWatch(
            directory,
            self._see,
            self._take,
            lambda _, kind: kind in PREFERENCE,
            self._take_air,
            lambda: self._station.wants_air(time.monotonic()),
            MOST_WAITING,
        )
        self._station = world.station(self._key, directory.name, self._watch.ask)

    async def run(self) -> None:
        """Follow the daemon until cancelled."""
        await self._watch.run()

    def _see(self, snapshot: Snapshot | None) -> None:
        if snapshot is not None:
            self._station.report(snapshot, time.monotonic())

    def _take(self, source: Source, cdr: bytes) -> None:
        self._world.take_position(
            () if source.is_sent else (self._key,), source.robot, source.topic, source.kind, cdr,
            time.monotonic(),
        )  # fmt: skip

    def _take_air(self, packed: bytes) -> None:
        robot = self._station.robot
        if robot is not None:
            self._station.air.take(packed, robot)
