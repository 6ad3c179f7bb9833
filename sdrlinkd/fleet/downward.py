"""Commands of operators on their way to the daemon, and what became of them."""

import asyncio
import time
from collections.abc import Callable

from sdrlinkd.client import (
    AsyncPublisher,
    MessageRefusedError,
    NoDaemonError,
    Receipt,
    RefusedError,
)
from sdrlinkd.daemon_side import DaemonSide
from sdrlinkd.fleet.commands import TAKEN, Commands, Id, Order, Refusal
from sdrlinkd.fleet.formats import Command, Fate, encode, is_passed, read_command, read_fate
from sdrlinkd.fleet.keys import Keys, TopicKey
from sdrlinkd.fleet.report import Counts
from sdrlinkd.fleet.samples import Sample
from sdrlinkd.fleet.session import Session
from sdrlinkd.fleet.topics import matches
from sdrlinkd.wire import is_topic_name

LOOK_S = 0.5
MOST_WAIT_S = 1.0
"""Longest time in s that a command waits for a daemon that is busy or away."""
BACK_OFF_S = 0.05
"""The worse a gateway hears a robot, the longer it waits for others, at most this much more."""


class DownwardCommands:
    """Sends commands to robots through the daemon; times in s of one monotonic clock."""

    def __init__(
        self, own_id: int, keys: Keys, patterns: list[str], session: Session, counts: Counts,
        bus_name: Callable[[str], str], daemon: DaemonSide,
    ) -> None:  # fmt: skip
        self._own_id = own_id
        self._keys = keys
        self._patterns = patterns
        self._session = session
        self._counts = counts
        self._bus_name = bus_name
        self._daemon = daemon
        self._commands = Commands(own_id)
        self._awaited: dict[str, Id] = {}
        """The commands of which the daemon has yet to give a receipt, by its id."""
        self._awaits = asyncio.Event()
        """Set while receipts are awaited."""
        self._publisher: AsyncPublisher | None = None

    @property
    def due_at(self) -> float:
        """When `take_due` has something next, in s."""
        return self._commands.due_at

    def take(self, sample: Sample, score: float | None, now: float, *, leads: bool) -> Order | None:
        """Take a sample put at a robot's key, as `take_command` does."""
        told = self._keys.read_message(sample.key)
        if told is None or is_passed(sample.attachment):
            return None
        command = read_command(sample.attachment)
        return self.take_command(told, command, sample.payload, score, now, leads=leads)

    def take_command(
        self, told: TopicKey, command: Command | None, cdr: bytes, score: float | None, now: float,
        *, leads: bool,
    ) -> Order | None:  # fmt: skip
        """Take a command to a robot, None if it cannot be read; returns it if it is sent now.

        `score`: how well this gateway hears the robot; None: not at all.
        """
        self._counts.add("down_taken")
        if not is_topic_name(told.topic) or not matches(told.topic, self._patterns):
            self._counts.add("down_not_allowed")
            return None
        if command is None:
            self._counts.add("down_unreadable")
            return None
        if score is None:
            self._counts.add("down_left")
            return None
        patience_s = BACK_OFF_S * max(0.0, 1 - score)
        taken = self._commands.take(
            told.robot, told.topic, command, cdr, now, patience_s, leads=leads
        )
        if isinstance(taken, Refusal):
            self._counts.add(taken.value)
            return None
        if taken is None:
            self._counts.add("down_left")
        return taken

    def told(self, sample: Sample, now: float) -> None:
        """Take what another gateway says of a command."""
        robot, fate = self._keys.read_robot(sample.key), read_fate(sample.payload)
        if robot is not None and fate is not None:
            self._commands.told(robot, fate, now)

    def take_due(self, now: float) -> list[Order]:
        """The commands that no other gateway has taken in time, to be sent now."""
        due = self._commands.due(now)
        self._counts.add("down_left", -len(due))
        return due

    async def send(self, order: Order, now: float) -> None:
        """Hand a command to the daemon, and say so. Its age counts from when it came here."""
        robot, topic, _, _ = order.id
        command, publisher = order.command, self._publisher
        if publisher is None:
            self._counts.add("down_no_daemon")
            self._say(order.id, "dropped", "daemon_gone")
            return
        self._say(order.id, TAKEN)
        name = self._bus_name(topic)
        came_ns = time.time_ns() - round(1e9 * (now - order.came_at))
        wait_s = min(MOST_WAIT_S, max(0.0, order.until - now))

        try:
            id_ = await self._daemon.publish(
                publisher, name, order.cdr, command.ty, qos=command.q or None, dst=robot,
                lifespan_ms=command.ls, published_ns=came_ns, receipt=True, timeout_s=wait_s,
            )  # fmt: skip
        except (MessageRefusedError, RefusedError) as error:
            self._counts.add("down_refused")
            self._say(order.id, "dropped", str(error)[:120])
        except NoDaemonError:
            self._counts.add("down_no_daemon")
            self._say(order.id, "dropped", "daemon_gone")
        else:
            self._counts.add("down_sent")
            self._awaited[str(id_)] = order.id
            self._awaits.set()

    async def follow(self, publisher: AsyncPublisher) -> None:
        """Send by `publisher` from now on, and pass on what becomes of commands, forever."""
        self._publisher = publisher
        while True:
            await self._awaits.wait()
            receipt = await publisher.receipt(LOOK_S)
            if receipt is not None:
                self._received(receipt)
            elif not self._awaited:
                self._awaits.clear()

    def _received(self, receipt: Receipt) -> None:
        id_ = self._awaited.pop(receipt.id, None)
        if id_ is not None:
            self._say(id_, receipt.fate, receipt.reason)

    def _say(self, id_: Id, fate: str, reason: str = "") -> None:
        robot, topic, operator, number = id_
        told = Fate(self._own_id, topic, operator, number, fate, reason)
        self._session.put(self._keys.sent(robot), encode(told), None, "urgent")
