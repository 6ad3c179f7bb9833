"""For operators' programs: messages of a fleet's robots, each once, and commands to them."""

import asyncio
import itertools
import secrets
import time
from collections.abc import AsyncIterator, Callable
from pathlib import Path
from types import TracebackType
from typing import NamedTuple, Self

from sdrlinkd.config import FleetParams
from sdrlinkd.fleet.formats import Command, Fate, Passed, Qos, encode, read_fate, read_passed
from sdrlinkd.fleet.keys import Keys
from sdrlinkd.fleet.names import Duplicates
from sdrlinkd.fleet.samples import Sample
from sdrlinkd.fleet.session import Session, open_session

MOST_WAITING = 4096
ANSWER_S = 2.0
NOT_ENTERED = "enter the client with `async with` first"


class FleetMessage(NamedTuple):
    """A message of a robot, as a gateway put it."""

    robot: int
    topic: str
    payload: bytes
    passed: Passed
    """What the gateway says of it: type, age, SNR and so on."""


class FleetClient:
    """Hears the robots of a fleet, and sends to them; to be entered with `async with`."""

    def __init__(self, params: FleetParams, folder: Path = Path()) -> None:
        self._params = params
        self._folder = folder
        self._keys = Keys(params.name)
        self._session: Session | None = None
        self._messages: asyncio.Queue[FleetMessage] = asyncio.Queue(MOST_WAITING)
        self._duplicates = Duplicates()
        self._operator = secrets.token_hex(4)
        self._numbers = itertools.count()
        self.on_fate: Callable[[int, Fate], None] = lambda _robot, _fate: None
        """Called with what becomes of this program's commands."""
        self.overrun = 0
        """Messages dropped because nobody took them in time."""

    async def __aenter__(self) -> Self:
        self._session = await open_session(self._params, self._folder)
        self._session.subscribe(self._keys.all_messages, self._take)
        self._session.subscribe(self._keys.all_sent, self._told)
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._session is not None:
            await self._session.close()

    @property
    def duplicates(self) -> int:
        """Messages that came from a second gateway, too, and were dropped here."""
        return self._duplicates.dropped

    async def receive(self) -> FleetMessage:
        """Wait for the next message and return it."""
        return await self._messages.get()

    async def __aiter__(self) -> AsyncIterator[FleetMessage]:
        while True:
            yield await self.receive()

    def command(
        self, robot: int, topic: str, cdr: bytes, *, kind: str = "", qos: Qos = "",
        lifespan_ms: float | None = None,
    ) -> int:  # fmt: skip
        """Send a command to a robot; returns its number, which `on_fate` gets with its fate.

        `kind` is its type, needed for topics that the gateway's daemon does not know. `qos` is a
        class, by default that of the topic.
        """
        if self._session is None:
            raise RuntimeError(NOT_ENTERED)
        number = next(self._numbers)
        command = Command(self._operator, number, kind, qos, lifespan_ms)
        key = self._keys.message(robot, topic)
        self._session.put(key, cdr, encode(command), qos or "urgent")
        return number

    async def ask_gateways(self, what: str, within_s: float = ANSWER_S) -> dict[int, bytes]:
        """What each gateway answers: its `status`, or what it has `heard`, as JSON."""
        if self._session is None:
            raise RuntimeError(NOT_ENTERED)
        found = {}
        for each in await self._session.get(self._keys.every_gateway(what), within_s):
            gateway = self._keys.read_gateway(each.key)
            if gateway is not None:
                found[gateway] = each.payload
        return found

    def _take(self, sample: Sample) -> None:
        told, passed = self._keys.read_message(sample.key), read_passed(sample.attachment)
        if told is None or passed is None:
            return
        if not self._duplicates.is_new((sample.key, passed.sr), passed.name, time.monotonic()):
            return
        if self._messages.full():
            self._messages.get_nowait()
            self.overrun += 1
        self._messages.put_nowait(FleetMessage(*told, sample.payload, passed))

    def _told(self, sample: Sample) -> None:
        robot, fate = self._keys.read_robot(sample.key), read_fate(sample.payload)
        if robot is not None and fate is not None and fate.op == self._operator:
            self.on_fate(robot, fate)
