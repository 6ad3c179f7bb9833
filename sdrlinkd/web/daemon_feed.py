"""Follows one daemon over its sockets: its report, and the positions of robots."""

import asyncio
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import zmq
import zmq.asyncio

from sdrlinkd.asking import ask_status
from sdrlinkd.client import OUT_SOCKET, ControlClient, NoDaemonError, RefusedError, endpoint
from sdrlinkd.reports import Snapshot
from sdrlinkd.web.positions import PREFERENCE
from sdrlinkd.web.world import World

POLL_S = 0.5
PATIENCE_S = 2.0
DECLARED_S = 5.0
"""Time in s between two looks at which topics other robots have declared."""
SENT = b"\0sent\0"
AIR = b"\0air\0"
MOST_WAITING = 200
"""Messages that wait for this program; further ones are dropped."""


class _Source(NamedTuple):
    """A topic that says where a robot is; `is_sent`: as its own programs publish it."""

    robot: int
    topic: str
    kind: str
    is_sent: bool


class DaemonFeed:
    """Puts what the daemon at `directory` says into a world, also across its restarts."""

    def __init__(self, world: World, directory: Path) -> None:
        self._world = world
        self._directory = directory
        self._key = str(directory)
        self._station = world.station(self._key, directory.name, self.ask)
        # A ZeroMQ socket is for one thread.
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="ask")
        self._control: ControlClient | None = None
        self._declared: dict[str, str] = {}
        """Types of the topics that other robots declared, by name on the bus."""
        self._declared_at = float("-inf")
        self._sources: dict[bytes, _Source] = {}
        self._hears_air = False

    async def run(self) -> None:
        """Follow the daemon until cancelled."""
        with zmq.asyncio.Context() as context, context.socket(zmq.SUB) as heard:
            heard.linger = 0
            heard.rcvhwm = MOST_WAITING
            heard.connect(endpoint(self._directory, OUT_SOCKET))
            try:
                async with asyncio.TaskGroup() as group:
                    group.create_task(self._look(heard))
                    group.create_task(self._listen(heard))
            finally:
                self._thread.submit(self._close)
                self._thread.shutdown(wait=False)

    async def ask(self, verb: str, arguments: dict[str, Any] | None = None) -> Any:  # noqa: ANN401
        """The daemon's answer to `verb`. Raises NoDaemonError and RefusedError."""
        loop = asyncio.get_running_loop()
        return await loop.run_in_executor(self._thread, lambda: self._client().ask(verb, arguments))

    async def _look(self, heard: zmq.asyncio.Socket) -> None:
        loop = asyncio.get_running_loop()
        while True:
            snapshot = await loop.run_in_executor(self._thread, self._snapshot)
            if snapshot is not None:
                self._station.snapshot, self._station.at = snapshot, time.monotonic()
                self._subscribe(heard, snapshot)
            self._watch_air(heard)
            await asyncio.sleep(POLL_S)

    def _watch_air(self, heard: zmq.asyncio.Socket) -> None:
        """Have the daemon tell of the air as long as somebody looks."""
        wants = self._station.wants_air(time.monotonic())
        if wants != self._hears_air:
            (heard.subscribe if wants else heard.unsubscribe)(AIR)
            self._hears_air = wants

    async def _listen(self, heard: zmq.asyncio.Socket) -> None:
        while True:
            frames = await heard.recv_multipart()
            if frames[0] == AIR:
                robot = self._station.robot
                if robot is not None:
                    self._station.air.take(frames[1][1:], robot)
                continue
            source = self._sources.get(frames[0])
            if source is not None and len(frames) == 3:
                self._world.take_position(
                    () if source.is_sent else (self._key,), source.robot, source.topic, source.kind,
                    frames[2], time.monotonic(),
                )  # fmt: skip

    def _subscribe(self, heard: zmq.asyncio.Socket, snapshot: Snapshot) -> None:
        """Subscribe to the topics with positions, and to no others."""
        wanted = dict(_sources(snapshot, self._declared))
        for frame in self._sources.keys() - wanted.keys():
            heard.unsubscribe(frame)
        for frame in wanted.keys() - self._sources.keys():
            heard.subscribe(frame)
        self._sources = wanted

    def _client(self) -> ControlClient:
        if self._control is None:
            self._control = ControlClient(self._directory, PATIENCE_S)
        return self._control

    def _snapshot(self) -> Snapshot | None:
        """The daemon's report; None while it is away, or of another version."""
        try:
            snapshot = ask_status(self._client())
            if time.monotonic() > self._declared_at + DECLARED_S:
                self._declared_at = time.monotonic()
                declared = self._client().ask("declared")
                self._declared = {each["topic"]: each["type"] for each in declared}
        except NoDaemonError:
            # A new connection shows at once whether a daemon is there.
            self._close()
            return None
        except (RefusedError, msgspec.ValidationError):
            return None
        return snapshot

    def _close(self) -> None:
        if self._control is not None:
            self._control.close()
            self._control = None


def _sources(snapshot: Snapshot, declared: dict[str, str]) -> list[tuple[bytes, _Source]]:
    """The topics that say where robots are, with the frames that they begin with."""
    found = []
    kinds = {each.topic_id: each.type for each in snapshot.link.topics}
    for own in snapshot.link.topics:
        if own.type in PREFERENCE and own.subscribed:
            source = _Source(snapshot.node, own.name, own.type, is_sent=True)
            found.append((SENT + own.name.encode() + b"\0", source))
    for each in snapshot.link.received:
        name = each.republished_as
        kind = declared.get(name) or kinds.get(each.topic_id, "")
        if name and kind in PREFERENCE:
            source = _Source(each.src, name, kind, is_sent=False)
            found.append((name.encode() + b"\0", source))
    return found
