"""Many robots at one router: what gets lost, and what it costs."""

import asyncio
import time
from collections.abc import Iterator
from pathlib import Path

from benchmarks import processes
from benchmarks.fleet.field import FLEET, free_endpoint, routed
from benchmarks.report import Row
from sdrlinkd.config import FleetParams
from sdrlinkd.fleet import FleetClient, Keys, Passed, encode, open_session

ROBOTS, TOPICS = 50, 20
BYTES = 724


def rows(seed: int, quick: bool) -> Iterator[Row]:
    """50 robots with 20 topics at 1 Hz."""
    del seed
    seconds = 5 if quick else 30
    endpoint = free_endpoint()
    with routed(endpoint) as router:
        before = processes.usage(router.pid)
        began_at = time.monotonic()
        sent, came, twice = asyncio.run(_load(endpoint, seconds))
        took_s = time.monotonic() - began_at
        after = processes.usage(router.pid)
    yield Row(
        "lost_50_robots", sent - came, "messages", 0, "less", sent,
        note="50 robots × 20 topics at 1 Hz through one router, 724 B, default class (BLOCK)",
    )  # fmt: skip
    yield Row("twice_50_robots", twice, "messages", 0, "less", sent)
    yield Row(
        "router_cpu_pct", 100 * (after.cpu_s - before.cpu_s) / took_s, "%", None, "less", sent,
        peers={"memory_mib": after.rss_mib}, note="of one core, at 1000 messages/s",
    )  # fmt: skip


async def _load(endpoint: str, seconds: int) -> tuple[int, int, int]:
    """(messages put, messages that came, and came twice)."""
    params, keys = FleetParams(name=FLEET, connect=[endpoint]), Keys(FLEET)
    session = await open_session(params, Path())
    sent = came = 0
    async with FleetClient(params) as operator:

        async def hear() -> None:
            nonlocal came
            while True:
                await operator.receive()
                came += 1

        hearing = asyncio.ensure_future(hear())
        await asyncio.sleep(1.0)
        begin = time.monotonic()
        for number in range(seconds * ROBOTS * TOPICS):
            robot, topic = number % ROBOTS, number // ROBOTS % TOPICS
            told = Passed(7, "std_msgs/msg/String", 1, number % 256, number)
            key = keys.message(robot, f"topic_{topic}")
            sent += session.put(key, bytes(BYTES), encode(told), "default")
            if number % 10 == 0:
                await asyncio.sleep(max(0.0, begin + number / (ROBOTS * TOPICS) - time.monotonic()))
        await asyncio.sleep(1.0)
        hearing.cancel()
        twice = operator.duplicates
    await session.close()
    return sent, came, twice
