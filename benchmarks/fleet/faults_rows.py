"""What fails, and how soon messages and commands come again."""

import asyncio
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack
from itertools import pairwise

import numpy as np

from benchmarks import processes
from benchmarks.absent import PeerError
from benchmarks.fleet.drive import SETTLED_S, drive, message, number_of
from benchmarks.fleet.field import ROBOT, ROUTER, Field, field
from benchmarks.report import Row
from sdrlinkd.client import Subscriber
from sdrlinkd.fleet import FleetClient

PERIOD_S = 0.02
GATEWAYS = {7: 0.02, 8: 0.1}


def rows(seed: int, quick: bool) -> Iterator[Row]:
    """A router and a gateway that are killed."""
    n = 200 if quick else 500
    yield _router_killed(seed, n)
    yield _gateway_killed(seed, n)


def _router_killed(seed: int, n: int) -> Row:
    with field(GATEWAYS, seed) as where, ExitStack() as stack:

        def fail(number: int) -> None:
            if number == n // 2 and where.router is not None:
                where.router.kill()
                file, *ends = str(where.certificate), where.endpoint, where.door
                processes.start_module(stack, "router", ROUTER, file, *ends)

        found = asyncio.run(drive(where, n, PERIOD_S, fail))
    came = sorted(at[0] for at in found.at_operator.values())
    pause_s = max(after - before for before, after in pairwise(came))
    return Row(
        "router_killed_s", pause_s, "s", 2.0, "less", 1,
        note="longest pause at the operator while the router is killed and starts again at once",
    )  # fmt: skip


def _gateway_killed(seed: int, n: int) -> Row:
    with field(GATEWAYS, seed) as where:
        gaps = asyncio.run(_commands(where, n))
    return Row(
        "gateway_killed_s", float(np.max(gaps)), "s", 1.0, "less", n,
        peers={"period": PERIOD_S},
        note="longest pause of urgent commands at the robot while the leading gateway is killed",
    )  # fmt: skip


async def _commands(where: Field, n: int) -> list[float]:
    """The pauses in s between commands at the robot, of which the leader's end is one."""
    came: list[tuple[float, int]] = []
    is_over = threading.Event()

    def listen() -> None:
        with Subscriber("/*", runtime_dir=where.folders[ROBOT]) as heard:
            while not is_over.is_set():
                found = heard.receive(0.2)
                if found is not None:
                    came.append((time.monotonic(), number_of(found.payload)))

    thread = threading.Thread(target=listen)
    thread.start()
    senders: list[int] = []
    async with FleetClient(where.params) as operator:
        operator.on_fate = lambda _, fate: senders.append(fate.gw)
        await asyncio.sleep(SETTLED_S)
        for number in range(n):
            if number == n // 2:
                if not senders:
                    raise PeerError("no gateway has sent a command")
                where.gateways[senders[-1]].kill()
            operator.command(ROBOT, "cmd_vel", message(number, 64), lifespan_ms=500)
            await asyncio.sleep(PERIOD_S)
        await asyncio.sleep(1.0)
    is_over.set()
    thread.join()
    return [b - a for (a, _), (b, _) in pairwise(came)]
