"""What people at Foxglove want: taken from the server's threads; commands are sent on the bus."""

import asyncio
import json
import logging
import threading
import time
from collections.abc import Awaitable, Callable, Sequence
from math import inf
from typing import NamedTuple

from foxglove.websocket import ChannelView, Client, ClientChannel, ServerListener

from sdrlinkd.adapters import cdr_from_fields, check_cdr
from sdrlinkd.client import AsyncPublisher, MessageRefusedError, NoDaemonError, RefusedError
from sdrlinkd.errors import UserError
from sdrlinkd.foxglove.commands import Command, judge
from sdrlinkd.foxglove.door import CHANNEL
from sdrlinkd.reports import Snapshot

MOST_ADVERTISED = 1000
"""Most topics that all clients together may announce."""
MOST_BYTES = 1 << 16
"""Largest command in octets."""
MOST_BRACKETS = 4096
"""Most brackets of a command in JSON."""
NOT_ADMITTED = "publish: commands need the address with the token that the bridge printed"
QUIET_S = 2.0
"""For so long in s, the same sentence is not said again."""
MOST_SAID = 1000
MOST_WAIT_S = 1.0
"""Longest time in s that a command waits for a daemon that is busy or away."""

_log = logging.getLogger(__name__)


Publish = Callable[..., Awaitable[object]]
"""`DaemonSide.publish`."""


class _Waiting(NamedTuple):
    command: Command
    data: bytes
    came_ns: int


class Operators(ServerListener):
    """Takes what clients publish; tells by `subscribed(topic, client, at)` what they subscribe to.

    Methods `on_*` are called from threads of the server, all others from the loop.
    """

    def __init__(
        self, patterns: Sequence[str], secret: str, say: Callable[[str, str], None],
        publish: Publish, subscribed: Callable[[str, int, float], None],
    ) -> None:  # fmt: skip
        self._patterns = list(patterns)
        self._secret = secret
        self._admitted: set[int] = set()
        """Clients that came through the door with its token."""
        self._subscribed = subscribed
        self._say = say
        self._publish = publish
        self._loop = asyncio.get_running_loop()
        self._advertised: dict[tuple[int, int], Command | str] = {}
        self._lock = threading.Lock()
        self._waiting: dict[str, _Waiting] = {}
        """The newest command of each topic that is not sent yet."""
        self._is_woken = False
        self._has_come = asyncio.Event()
        self._said_at: dict[str, float] = {}
        """When each sentence was last said, by the loop's clock."""
        self.snapshot: Snapshot | None = None
        """The daemon's last report; None while it does not answer."""
        self.sent = 0
        """Commands that the daemon took."""
        self.refused = 0
        """Commands that were refused."""
        self.outdated = 0
        """Commands dropped for newer ones."""

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:
        """Tell that a client has subscribed to a topic, and at what monotonic time."""
        self._soon(self._subscribed, channel.topic, client.id, time.monotonic())

    def on_client_advertise(self, client: Client, channel: ClientChannel) -> None:
        """Note what a client is going to publish, and say at once if that is refused."""
        if channel.topic == self._secret:
            self._admitted.add(client.id)
            return
        told = judge(channel.topic, channel.schema_name, channel.encoding, self._patterns)
        if client.id not in self._admitted:
            told = NOT_ADMITTED
        if len(self._advertised) >= MOST_ADVERTISED:
            told = f"publish: got one topic more; allowed: {MOST_ADVERTISED}"
        else:
            self._advertised[client.id, channel.id] = told
        if isinstance(told, str):
            self._soon(self._refuse, channel.topic, told)

    def on_client_unadvertise(self, client: Client, client_channel_id: int) -> None:
        """Forget what a client no longer publishes."""
        self._advertised.pop((client.id, client_channel_id), None)
        if client_channel_id == CHANNEL:
            self._admitted.discard(client.id)

    def on_message_data(self, client: Client, client_channel_id: int, data: bytes) -> None:
        """Take a message of a client; an older one of its topic that still waits is dropped."""
        command = self._advertised.get((client.id, client_channel_id))
        with self._lock:
            if not isinstance(command, Command):
                # Why was said when the client announced the topic.
                self.refused += 1
                return
            if len(data) > MOST_BYTES:
                self.refused += 1
                sentence = f"{command.name}: got {len(data)} bytes; allowed: {MOST_BYTES}"
                self._soon(self._refuse, command.name, sentence)
                return
            self.outdated += command.name in self._waiting
            self._waiting[command.name] = _Waiting(command, data, time.time_ns())
            wakes, self._is_woken = not self._is_woken, True
        if wakes:
            self._soon(self._has_come.set)

    async def send_all(self, out: AsyncPublisher) -> None:
        """Send commands as they come, until cancelled."""
        while True:
            await self._has_come.wait()
            self._has_come.clear()
            while (next_ := self._next()) is not None:
                await self._send(next_, out)

    def _next(self) -> _Waiting | None:
        with self._lock:
            self._is_woken = bool(self._waiting)
            return self._waiting.pop(next(iter(self._waiting))) if self._waiting else None

    def _soon(self, call: Callable[..., None], *arguments: object) -> None:
        # After the end of the loop nobody needs it any more.
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(call, *arguments)

    async def _send(self, waiting: _Waiting, out: AsyncPublisher) -> None:
        command = waiting.command
        try:
            name, cdr = self._bus_name(command), cdr_of(command, waiting.data)
            await self._publish(
                out, name, cdr, command.type, qos="urgent", dst=command.robot,
                published_ns=waiting.came_ns, timeout_s=MOST_WAIT_S,
            )  # fmt: skip
        except (MessageRefusedError, RefusedError, UserError, NoDaemonError) as error:
            self.refused += 1
            self._refuse(command.name, f"{command.name}: not sent: {error}")
        else:
            self.sent += 1

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
        return own if own in taken else command.name

    def _refuse(self, topic: str, sentence: str) -> None:
        """Say why something is refused, but not again and again."""
        now = self._loop.time()
        if now - self._said_at.get(sentence, -inf) < QUIET_S:
            return
        if len(self._said_at) >= MOST_SAID:
            self._said_at.clear()
        self._said_at[sentence] = now
        _log.warning("%s", sentence)
        self._say(topic, sentence)


def cdr_of(command: Command, data: bytes) -> bytes:
    """The message of a client as CDR. Raises UserError."""
    cdr = data if command.encoding == "cdr" else _cdr_of_json(command, data)
    check_cdr(command.type, cdr, command.name)
    return cdr


def _cdr_of_json(command: Command, data: bytes) -> bytes:
    # A string may hold brackets, but no command has so many.
    if data.count(b"[") + data.count(b"{") > MOST_BRACKETS:
        raise UserError(f"got more than {MOST_BRACKETS} brackets; allowed: a message's fields")
    try:
        fields = json.loads(data, parse_constant=_no_number)
    except (ValueError, RecursionError) as error:
        raise UserError(f"no JSON: {error}") from None
    return cdr_from_fields(command.type, fields, command.name)


def _no_number(text: str) -> object:
    raise UserError(f"got {text}; allowed: finite numbers")
