"""Watches one daemon over its sockets: its reports, and chosen topics in both directions."""

import asyncio
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import zmq
import zmq.asyncio

from sdrlinkd.asking import ask_status
from sdrlinkd.client import OUT_SOCKET, ControlClient, NoDaemonError, RefusedError, endpoint
from sdrlinkd.reports import Snapshot

POLL_S = 0.5
PATIENCE_S = 2.0
DECLARED_S = 5.0
"""Time in s between two looks at which topics other robots have declared."""
SENT = b"\0sent\0"
AIR = b"\0air\0"
MOST_WAITING = 200
"""Messages that wait for this program; further ones are dropped."""


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
    of the air (bus document, 4.5), as long as `wants_air` returns True.
    """

    def __init__(
        self,
        directory: Path,
        see: Callable[[Snapshot | None], None],
        take: Callable[[Source, bytes], None],
        wants: Callable[[str, str], bool],
        take_air: Callable[[bytes], None] = lambda _: None,
        wants_air: Callable[[], bool] = lambda: False,
    ) -> None:
        self._directory = directory
        self._see = see
        self._take = take
        self._wants = wants
        self._take_air = take_air
        self._wants_air = wants_air
        # A ZeroMQ socket is for one thread.
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="ask")
        self._control: ControlClient | None = None
        self._declared: dict[str, str] = {}
        """Types of the topics that other robots declared, by name on the bus."""
        self._declared_at = float("-inf")
        self._sources: dict[bytes, Source] = {}
        self._hears_air = False

    async def run(self) -> None:
        """Watch the daemon until cancelled."""
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
            self._see(snapshot)
            if snapshot is not None:
                self._subscribe(heard, snapshot)
            self._watch_air(heard)
            await asyncio.sleep(POLL_S)

    def _watch_air(self, heard: zmq.asyncio.Socket) -> None:
        wants = self._wants_air()
        if wants != self._hears_air:
            (heard.subscribe if wants else heard.unsubscribe)(AIR)
            self._hears_air = wants

    async def _listen(self, heard: zmq.asyncio.Socket) -> None:
        while True:
            frames = await heard.recv_multipart()
            if frames[0] == AIR:
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
                yield SENT + own.name.encode() + b"\0", source
        for each in snapshot.link.received:
            name = each.republished_as
            kind = self._declared.get(name) or kinds.get(each.topic_id, "")
            if name and self._wants(name, kind):
                yield name.encode() + b"\0", Source(each.src, name, kind, is_sent=False)

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
