"""Messages of robots on other airs, on their way to the robots on this one."""

import asyncio
import time
from collections import OrderedDict, deque
from collections.abc import Callable
from math import inf
from typing import NamedTuple

from sdrlinkd.client import (
    AsyncPublisher,
    MessageName,
    MessageRefusedError,
    NoDaemonError,
    RefusedError,
)
from sdrlinkd.daemon_side import DaemonSide
from sdrlinkd.fleet.formats import Passed, read_passed
from sdrlinkd.fleet.heard_robots import PRESENT_S
from sdrlinkd.fleet.keys import Keys, TopicKey
from sdrlinkd.fleet.names import Duplicates
from sdrlinkd.fleet.report import Counts
from sdrlinkd.fleet.samples import Sample
from sdrlinkd.fleet.session import Session
from sdrlinkd.fleet.topics import matches
from sdrlinkd.wire import is_topic_name

LOOK_S = 0.5
MOST_WAITING = 512
MOST_WAIT_S = 1.0
"""Longest time in s that a message waits for a daemon that is busy."""
MOST_TOPICS = 128
"""Topics of other robots; the daemon has 240 numbers for them and for those of its own robot."""
ANSWER_S = 2.0
MOST_REMEMBERED = 4096


class _Waiting(NamedTuple):
    told: TopicKey
    passed: Passed
    payload: bytes
    at: float


class Bridge:
    """Sends what other gateways put through the daemon; times in s of one monotonic clock.

    `is_others`: whether another gateway does so on this air. `is_near`: whether a robot is
    on this air itself. `bus_name`: the name on the bus of another robot's topic.
    """

    def __init__(
        self, own_id: int, keys: Keys, patterns: list[str], session: Session, counts: Counts,
        is_others: Callable[[], bool], is_near: Callable[[int], bool],
        bus_name: Callable[[int, str], str], daemon: DaemonSide,
    ) -> None:  # fmt: skip
        self._own_id = own_id
        self._keys = keys
        self._patterns = patterns
        self._session = session
        self._counts = counts
        self._is_others = is_others
        self._settled_at = inf
        """When the daemon must have heard who is on its air; inf: it is away."""
        self._is_reached = asyncio.Event()
        self._is_near = is_near
        self._bus_name = bus_name
        self._daemon = daemon
        self._duplicates = Duplicates()
        self._newest: OrderedDict[tuple[str, int], MessageName | None] = OrderedDict()
        """Name of the last message that was sent, by key and series."""
        self._topics: set[str] = set()
        """The topics for which the daemon has numbers, by their names on the bus."""
        self._waiting: deque[_Waiting] = deque()
        self._came = asyncio.Event()

    def take(self, sample: Sample, now: float) -> None:
        """Take what was put at the key of a message, or an answer to a query for it."""
        told, passed = self._keys.read_message(sample.key), read_passed(sample.attachment)
        if told is None or passed is None or passed.gw == self._own_id:
            return
        self._counts.add("bridge_taken")
        end = self._end(sample.key, told, passed, now)
        if end:
            self._counts.add(end)
            return
        self._note((sample.key, passed.sr), passed.name)
        if len(self._waiting) >= MOST_WAITING:
            self._waiting.popleft()
            self._counts.move("bridge_waiting", "bridge_overflow")
        self._waiting.append(_Waiting(told, passed, sample.payload, now))
        self._counts.add("bridge_waiting")
        self._came.set()

    @property
    def sends(self) -> bool:
        """Whether this gateway sends for robots on other airs now."""
        is_settled = time.monotonic() >= self._settled_at
        return bool(self._patterns) and is_settled and not self._is_others()

    def see(self, is_there: bool, now: float) -> None:
        """Note whether the daemon answers."""
        self._settled_at = min(self._settled_at, now + PRESENT_S) if is_there else inf
        if not is_there:
            # It begins with new numbers, if it has restarted.
            self._topics.clear()

    def reach(self) -> None:
        """Note that the network is there from now on."""
        self._is_reached.set()

    async def run(self, publisher: AsyncPublisher) -> None:
        """Hand what waits to the daemon, forever."""
        async with asyncio.TaskGroup() as group:
            group.create_task(self._ask())
            while True:
                await self._send(publisher)

    async def _ask(self) -> None:
        """Take the last messages, as far as they are new, whenever the network has come."""
        while True:
            await self._is_reached.wait()
            self._is_reached.clear()
            while time.monotonic() < self._settled_at:  # noqa: ASYNC110 (the time itself moves)
                await asyncio.sleep(LOOK_S)
            for answer in await self._session.get(self._keys.all_messages, ANSWER_S):
                self.take(Sample(*answer), time.monotonic())

    def _end(self, key: str, told: TopicKey, passed: Passed, now: float) -> str:
        """Why a message is not sent; empty if it is."""
        if not is_topic_name(told.topic) or not matches(told.topic, self._patterns):
            return "bridge_not_allowed"
        if held := self._held(told, now):
            return held
        if passed.stop:
            return "bridge_stop"
        if passed.again and passed.age is None:
            return "bridge_no_age"
        series = (key, passed.sr)
        newest = self._newest.get(series) if passed.again else None
        if newest is not None and passed.name is not None and newest.matches(passed.name):
            return "bridge_repeated"
        return "" if self._duplicates.is_new(series, passed.name, now) else "bridge_repeated"

    def _held(self, told: TopicKey, now: float) -> str:
        """Why no message of a robot is sent now; empty: it is."""
        if now < self._settled_at:
            return "bridge_no_daemon"
        if self._is_near(told.robot):
            return "bridge_near"
        return "bridge_left" if self._is_others() else ""

    def _note(self, series: tuple[str, int], name: MessageName | None) -> None:
        self._newest[series] = name
        self._newest.move_to_end(series)
        if len(self._newest) > MOST_REMEMBERED:
            self._newest.popitem(last=False)

    async def _send(self, publisher: AsyncPublisher) -> None:
        """Hand the next message to the daemon."""
        while not self._waiting:
            self._came.clear()
            await self._came.wait()
        told, passed, payload, at = self._waiting.popleft()
        if end := self._held(told, time.monotonic()):
            # That has changed while it waited.
            self._counts.move("bridge_waiting", end)
            return
        name, end = self._bus_name(*told), "bridge_sent"
        if name not in self._topics and len(self._topics) >= MOST_TOPICS:
            self._counts.move("bridge_waiting", "bridge_refused")
            return
        self._topics.add(name)
        age_ns = 1_000 * (passed.age or 0) + round(1e9 * (time.monotonic() - at))
        try:
            await self._daemon.publish(
                publisher, name, payload, passed.ty, key=str(passed.sr) if passed.sr else None,
                published_ns=time.time_ns() - age_ns, timeout_s=MOST_WAIT_S,
            )  # fmt: skip
        except (MessageRefusedError, RefusedError):
            end = "bridge_refused"
        except NoDaemonError:
            end = "bridge_no_daemon"
        self._counts.move("bridge_waiting", end)
