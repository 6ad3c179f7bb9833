"""Watches one daemon over its sockets: its reports, and chosen topics in both directions."""

import asyncio
import contextlib
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import zmq
import zmq.asyncio

from sdrlinkd.asking import Asker
from sdrlinkd.bus import AIR_TAP, SENT_TAP
from sdrlinkd.client import OUT_SOCKET, NoDaemonError, RefusedError, endpoint
from sdrlinkd.reports import Snapshot

POLL_S = 0.5
PATIENCE_S = 2.0
DECLARED_S = 5.0
"""Time in s between two looks at which topics other robots have declared."""


class Source(NamedTuple):
    """A topic of a robot; `is_sent`: as its own programs publish it, rather than as received."""

    robot: int
    topic: str
    kind: str
    is_sent: bool


class DaemonWatch:
    """Watches the daemon at `directory`, also across its restarts.

    `see` gets each report, or None while the daemon is away, and `take` the messages of the topics
    for which `wants` returns True, by name on the bus and type. `take_air` gets what it says
    of the air (bus document, 4.5), as long as `wants_air` returns True. Of the messages that come
    too fast, `most_waiting` wait and the others are dropped; 0: all wait.
    """

    def __init__(
        self,
        directory: Path,
        see: Callable[[Snapshot | None], None],
        take: Callable[[Source, bytes], None],
        wants: Callable[[str, str], bool],
        take_air: Callable[[bytes], None] = lambda _: None,
        wants_air: Callable[[], bool] = lambda: False,
        most_waiting: int = 0,
    ) -> None:
        self._directory = directory
        self._see = see
        self._take = take
        self._wants = wants
        self._take_air = take_air
        self._wants_air = wants_air
        self._most_waiting = most_waiting
        self._asker = Asker(directory, PATIENCE_S)
        self._declared: dict[str, str] = {}
        """Types of the topics that other robots declared, by name on the bus."""
        self._declared_at = float("-inf")
        self._sources: dict[bytes, Source] = {}
        self._hears_air = False

    async def run(self) -> None:
        """Watch the daemon until cancelled."""
        with zmq.asyncio.Context() as context, context.socket(zmq.SUB) as heard:
            heard.linger = 0
            heard.rcvhwm = self._most_waiting
            heard.connect(endpoint(self._directory, OUT_SOCKET))
            try:
                async with asyncio.TaskGroup() as group:
                    group.create_task(self._look(heard))
                    group.create_task(self._listen(heard))
            finally:
                self._asker.close()

    async def ask(self, verb: str, arguments: dict[str, Any] | None = None) -> Any:  # noqa: ANN401
        """The daemon's answer to `verb`. Raises NoDaemonError and RefusedError."""
        return await self._asker.ask(verb, arguments)

    async def _look(self, heard: zmq.asyncio.Socket) -> None:
        while True:
            snapshot = await self._asker.snapshot()
            self._see(snapshot)
            if snapshot is not None:
                await self._learn_types()
                self._subscribe(heard, snapshot)
            self._watch_air(heard)
            await asyncio.sleep(POLL_S)

    async def _learn_types(self) -> None:
        """Look from time to time which topics other robots have declared, of which types."""
        if time.monotonic() < self._declared_at + DECLARED_S:
            return
        self._declared_at = time.monotonic()
        with contextlib.suppress(NoDaemonError, RefusedError):
            declared = await self._asker.ask("declared")
            self._declared = {each["topic"]: each["type"] for each in declared}

    def _watch_air(self, heard: zmq.asyncio.Socket) -> None:
        wants = self._wants_air()
        if wants != self._hears_air:
            (heard.subscribe if wants else heard.unsubscribe)(AIR_TAP)
            self._hears_air = wants

    async def _listen(self, heard: zmq.asyncio.Socket) -> None:
        while True:
            frames = await heard.recv_multipart()
            if frames[0] == AIR_TAP:
                self._take_air(frames[1][1:])
                continue
            source = self._sources.get(frames[0])
            if source is not None and len(frames) == 3:
                self._take(source, frames[2])

    def _subscribe(self, heard: zmq.asyncio.Socket, snapshot: Snapshot) -> None:
        """Subscribe to the topics that are wanted, and to no others."""
        wanted = dict(self._wanted(snapshot))
        for frame in self._sources.keys() - wanted.keys():
            heard.unsubscribe(frame)
        for frame in wanted.keys() - self._sources.keys():
            heard.subscribe(frame)
        self._sources = wanted

    def _wanted(self, snapshot: Snapshot) -> Iterator[tuple[bytes, Source]]:
        """The topics that are wanted, with the frames that they begin with."""
        kinds = {each.topic_id: each.type for each in snapshot.link.topics}
        for own in snapshot.link.topics:
            if own.subscribed and self._wants(own.name, own.type):
                source = Source(snapshot.node, own.name, own.type, is_sent=True)
                yield SENT_TAP + own.name.encode() + b"\0", source
        for each in snapshot.link.received:
            name = each.republished_as
            kind = self._declared.get(name) or kinds.get(each.topic_id, "")
            if name and self._wants(name, kind):
                yield name.encode() + b"\0", Source(each.src, name, kind, is_sent=False)
