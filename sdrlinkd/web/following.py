"""Follows all daemons that there are, also those that start later."""

import asyncio
from collections.abc import Callable, Iterable
from pathlib import Path

from sdrlinkd.web.daemon_feed import DaemonFeed
from sdrlinkd.web.viewer import now_s
from sdrlinkd.web.world import World

LOOK_S = 2.0
FORGOTTEN_S = 60.0
"""Time in s after which a daemon that has gone is not shown any more."""


async def follow_daemons(world: World, find: Callable[[], Iterable[Path]]) -> None:
    """Follow the daemons in the directories that `find` returns, until cancelled."""
    feeds: dict[Path, asyncio.Task[None]] = {}
    async with asyncio.TaskGroup() as group:
        while True:
            found = set(await asyncio.to_thread(lambda: list(find())))
            for path in sorted(found - feeds.keys()):
                feeds[path] = group.create_task(DaemonFeed(world, path).run())
            for path in feeds.keys() - found:
                if now_s() > world.stations[str(path)].at + FORGOTTEN_S:
                    feeds.pop(path).cancel()
                    world.forget(str(path))
            await asyncio.sleep(LOOK_S)
