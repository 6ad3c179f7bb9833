"""Follows a fleet over Zenoh: what gateways report, and the positions of robots."""

import asyncio
import time
from pathlib import Path

import msgspec

from sdrlinkd.config import FleetParams
from sdrlinkd.fleet import FleetClient
from sdrlinkd.reports import Snapshot
from sdrlinkd.web.world import World

POLL_S = 1.0
_decode = msgspec.json.Decoder(Snapshot | None).decode


async def follow_fleet(world: World, params: FleetParams, folder: Path) -> None:
    """Follow a fleet until cancelled; file names are relative to `folder`. Raises UserError."""
    async with FleetClient(params, folder) as client, asyncio.TaskGroup() as group:
        group.create_task(_look(world, client))
        group.create_task(_listen(world, client))


async def _look(world: World, client: FleetClient) -> None:
    """Ask all gateways for their daemons' reports, once a second."""
    while True:
        for gateway, told in (await client.ask_gateways("status")).items():
            try:
                snapshot = _decode(told)
            except msgspec.MsgspecError:
                continue  # of another version
            if snapshot is not None:
                name = f"gateway {gateway}"
                world.station(name, name).report(snapshot, time.monotonic())
        await asyncio.sleep(POLL_S)


async def _listen(world: World, client: FleetClient) -> None:
    async for message in client:
        # Whichever gateway put it, the fleet has it.
        world.take_position(
            world.stations, message.robot, message.topic, message.passed.ty, message.payload,
            time.monotonic(),
        )  # fmt: skip
