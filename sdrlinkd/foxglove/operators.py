"""Commands of people at Foxglove: taken from the server's threads, and sent on the bus."""

import asyncio
import json
import logging
import time
from collections.abc import Awaitable, Callable, Sequence
from typing import NamedTuple

from foxglove.websocket import Client, ClientChannel, ServerListener

from sdrlinkd.adapters import cdr_from_fields
from sdrlinkd.client import AsyncPublisher, MessageRefusedError, NoDaemonError, RefusedError
from sdrlinkd.errors import UserError
from sdrlinkd.foxglove.commands import Command, judge
from sdrlinkd.reports import Snapshot

MOST_ADVERTISED = 1000
"""Most topics that all clients together may announce."""
MOST_WAIT_S = 1.0
"""Longest time in s that a command waits for a daemon that is busy or away."""

_log = logging.getLogger(__name__)


class _Waiting(NamedTuple):
    command: Command
    data: bytes
    came_ns: int


class Operators(ServerListener):
    """Takes what clients publish. Methods `on_*` are called from threads of the server."""

    def __init__(
        self, patterns: Sequence[str], say: Callable[[str, str], None],
        declare: Callable[[str, str], Awaitable[None]],
    ) -> None:  # fmt: skip
        self._patterns = list(patterns)
        self._say = say
        self._declare = declare
        self._loop = asyncio.get_running_loop()
        self._advertised: dict[tuple[int, int], Command | str] = {}
        self._waiting: dict[str, _Waiting] = {}
        """The newest command of each topic that is not sent yet."""
        self._has_come = asyncio.Event()
        self.snapshot: Snapshot | None = None
        """The daemon's last report; None while it does not answer."""
        self.sent = 0
        """Commands that the daemon took."""
        self.refused = 0
        """Commands that were refused."""
        self.outdated = 0
        """Commands dropped for newer ones."""

    def on_client_advertise(self, client: Client, channel: ClientChannel) -> None:
        """Note what a client is going to publish, and say at once if that is refused."""
        told = judge(channel.topic, channel.schema_name, channel.encoding, self._patterns)
        if len(self._advertised) >= MOST_ADVERTISED:
            told = f"publish: got one topic more; allowed: {MOST_ADVERTISED}"
        else:
            self._advertised[client.id, channel.id] = told
        if isinstance(told, str):
            self._soon(self._refuse, channel.topic, told)

    def on_client_unadvertise(self, client: Client, client_channel_id: int) -> None:
        """Forget what a client no longer publishes."""
        self._advertised.pop((client.id, client_channel_id), None)

    def on_message_data(self, client: Client, client_channel_id: int, data: bytes) -> None:
        """Take a message of a client."""
        command = self._advertised.get((client.id, client_channel_id))
        self._soon(self._take, command, data, time.time_ns())

    async def send_all(self, directory: str | None) -> None:
        """Send commands as they come, until cancelled."""
        async with AsyncPublisher(runtime_dir=directory) as publisher:
            while True:
                await self._has_come.wait()
                self._has_come.clear()
                while self._waiting:
                    await self._send(self._waiting.pop(next(iter(self._waiting))), publisher)

    def _soon(self, call: Callable[..., None], *arguments: object) -> None:
        # After the end of the loop nobody needs it any more.
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(call, *arguments)

    def _take(self, command: Command | str | None, data: bytes, came_ns: int) -> None:
        if not isinstance(command, Command):
            # Why was said when the client announced the topic.
            self.refused += 1
            return
        name = f"/robot_{command.robot}{command.topic}"
        self.outdated += name in self._waiting
        self._waiting[name] = _Waiting(command, data, came_ns)
        self._has_come.set()

    async def _send(self, waiting: _Waiting, publisher: AsyncPublisher) -> None:
        command = waiting.command
        shown = f"/robot_{command.robot}{command.topic}"
        try:
            name = self._bus_name(command)
            cdr = _cdr(command, waiting.data, shown)
            try:
                await self._publish(publisher, name, cdr, waiting)
            except MessageRefusedError as error:
                if error.reason != "tx_unknown_topic":
                    raise
                await self._declare(name, command.type)
                await self._publish(publisher, name, cdr, waiting)
        except (MessageRefusedError, RefusedError, UserError, NoDaemonError) as error:
            self.refused += 1
            self._refuse(shown, f"{shown}: not sent: {error}")
        else:
            self.sent += 1

    async def _publish(
        self, publisher: AsyncPublisher, name: str, cdr: bytes, waiting: _Waiting
    ) -> None:
        await publisher.send(
            name, cdr, qos="urgent", dst=waiting.command.robot, type=waiting.command.type,
            published_ns=waiting.came_ns, timeout_s=MOST_WAIT_S,
        )  # fmt: skip

    def _bus_name(self, command: Command) -> str:
        """What the command is called on the bus.

        A topic of the registry is this robot's own, sent to the other one. Any other is called as
        the ROS 2 bridge calls it.
        """
        if self.snapshot is None:
            raise UserError("the daemon does not answer")
        if command.robot == self.snapshot.node:
            raise UserError("this is the bridge's own robot; allowed: other robots")
        namespace = self.snapshot.namespace.strip("/")
        own = f"/{namespace}{command.topic}" if namespace else command.topic
        taken = {each.name for each in self.snapshot.link.topics if each.subscribed}
        return own if own in taken else f"/robot_{command.robot}{command.topic}"

    def _refuse(self, topic: str, sentence: str) -> None:
        _log.warning("%s", sentence)
        self._say(topic, sentence)


def _cdr(command: Command, data: bytes, shown: str) -> bytes:
    """The message of a client as CDR. Raises UserError."""
    if command.encoding == "cdr":
        return data
    try:
        fields = json.loads(data)
    except ValueError as error:
        raise UserError(f"no JSON: {error}") from None
    return cdr_from_fields(command.type, fields, shown)
