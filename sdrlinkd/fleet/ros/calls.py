"""Services of robots as services of this gateway's node: each call is executed at most once."""

import asyncio
import contextlib
import logging
import secrets
import time
from collections import Counter
from collections.abc import Callable, Collection
from random import SystemRandom
from typing import NamedTuple

from sdrlinkd.calls import (
    ACTION,
    CALL_TYPE,
    CANCEL_GOAL,
    GET_RESULT,
    WORDS,
    Asker,
    Ended,
    Kind,
    Packet,
    Sent,
    Service,
    Status,
    calls_name,
    understood,
)
from sdrlinkd.client import (
    UNKNOWN_TOPIC,
    AsyncPublisher,
    MessageRefusedError,
    NoDaemonError,
    RefusedError,
)
from sdrlinkd.daemon_side import DaemonSide
from sdrlinkd.fleet.ros.attachment import Attachment
from sdrlinkd.fleet.ros.graph import Graph
from sdrlinkd.fleet.ros.names import (
    UNKNOWN_HASH,
    Qos,
    Role,
    at_robot,
    data_key,
    dds_type,
    is_name,
)
from sdrlinkd.fleet.samples import Question
from sdrlinkd.fleet.session import Session
from sdrlinkd.fleet.topics import matches

BUSY_S, LOOK_S = 0.02, 0.5
MOST_PROXIES = 500
MOST_ASKED = 64
"""Calls that are under way at a time, and as many to cancel; further ones are not taken."""
MOST_RESULTS = 512
"""The same of calls for results, which take as long as the action."""
NOT_TAKEN = "calls_not_taken"

_log = logging.getLogger(__name__)


class _Asked(NamedTuple):
    robot: int
    service: str
    question: Question
    attachment: Attachment


class Calls:
    """Serves what robots offer, and asks them over the daemon.

    `patterns`: the services, or actions, that may be called. `leads`:
    whether this gateway leads for a robot at this moment.
    """

    def __init__(
        self, graph: Graph, session: Session, patterns: list[str], daemon: DaemonSide,
        leads: Callable[[int], bool],
    ) -> None:  # fmt: skip
        self._graph = graph
        self._session = session
        self._patterns = patterns
        self._daemon = daemon
        self._leads = leads
        self._asker = Asker(secrets.randbits(32), SystemRandom())
        self._asked: dict[int, _Asked] = {}
        self._told: dict[int, list[Service]] = {}
        self._proxies: dict[tuple[int, Service], Callable[[], None]] = {}
        self._served: frozenset[int] = frozenset()
        self._reached: set[int] = set()
        """The robots for which the daemon knows the topic of calls."""
        self._news = asyncio.Event()
        self.counts: Counter[str] = Counter()
        """Calls by how they ended, and those that were not taken."""

    def offer(self, robot: int, cdr: bytes) -> None:
        """Take what a robot says of its services."""
        services = understood(cdr)
        if services is not None:
            self._told[robot] = services
            self._settle()

    def offered(self, robot: int, name: str) -> Service | None:
        """The service of a robot with this name, if it offers one."""
        return next((each for each in self._told.get(robot, ()) if each.name == name), None)

    def serve(self, robots: Collection[int]) -> None:
        """Serve what these robots offer, and no others.

        Where several gateways hear a robot, only one may serve, or a call would be made twice.
        """
        if self._served != frozenset(robots):
            self._served = frozenset(robots)
            self._settle()

    def forget(self, robot: int) -> None:
        """End the calls of a robot that has gone. What it offers is told only once, so it stays."""
        for number in [n for n, asked in self._asked.items() if asked.robot == robot]:
            self._asker.drop(number)
            self._end(Ended(number, Status.TIMED_OUT))

    def hear(self, robot: int, payload: bytes) -> None:
        """Take a packet of a robot: an answer, or word that a call runs."""
        packet = Packet.parse(payload)
        if packet is None or packet.kind not in (Kind.TAKEN, Kind.ANSWER):
            return
        ended = self._asker.hear(robot, packet, time.monotonic())
        self._news.set()
        if ended is not None:
            self._end(ended)

    async def run(self, out: AsyncPublisher) -> None:
        """Send what is due over the daemon, forever."""
        while True:
            await self._turn(out)

    async def _turn(self, out: AsyncPublisher) -> None:
        """Send what is due, and wait until there is more to do."""
        now = time.monotonic()
        for ended in self._asker.expired(now):
            self._end(ended)
        for sent in self._asker.due(now):
            await self._send(out, sent)
        is_reached = await self._reach({robot for robot, _ in self._proxies})
        with contextlib.suppress(TimeoutError):
            wait_s = BUSY_S if self._asked else None if is_reached else LOOK_S
            await asyncio.wait_for(self._news.wait(), wait_s)
        self._news.clear()

    async def _reach(self, robots: set[int]) -> bool:
        """Have the daemon know the topics of calls to `robots`, so that they can answer.

        False while it is away.
        """
        for robot in robots - self._reached:
            try:
                await self._daemon.ask("declare", {"name": _bus_name(robot), "type": CALL_TYPE})
            except NoDaemonError:
                return False
            except RefusedError as error:
                _log.warning("robot %d cannot be called: %s", robot, error)
            self._reached.add(robot)
        return True

    async def _send(self, out: AsyncPublisher, sent: Sent) -> None:
        robot, packet = sent
        qos = "urgent" if packet.is_cancel else "latency"
        try:
            await out.send(_bus_name(robot), packet.build(), dst=robot, qos=qos, wait=False)
        except MessageRefusedError as error:
            if error.reason == UNKNOWN_TOPIC:
                # The daemon has restarted. The packet is sent again later.
                self._reached.discard(robot)
            elif packet.kind == Kind.REQUEST:
                self._asker.drop(packet.number)
                self._end(Ended(packet.number, Status.TOO_LARGE))

    def _settle(self) -> None:
        """Have a service for each that the robots served offer and that may be called."""
        wanted = {
            (robot, service): None
            for robot in self._served
            for service in self._told.get(robot, ())
            if self._may_call(service)
        }
        for key in self._proxies.keys() - wanted.keys():
            self._proxies.pop(key)()
        for robot, service in wanted:
            if (robot, service) not in self._proxies and len(self._proxies) < MOST_PROXIES:
                self._proxies[robot, service] = self._serve(robot, service)
        self._news.set()

    def _may_call(self, service: Service) -> bool:
        name = service.name.split(ACTION)[0].removeprefix("/")
        is_known = is_name(service.name) and dds_type(service.kind)
        return bool(is_known) and matches(name, self._patterns)

    def _serve(self, robot: int, service: Service) -> Callable[[], None]:
        name, kind = at_robot(robot, service.name), dds_type(service.kind)
        opened = self._graph.open(Role.SERVICE, name, kind, UNKNOWN_HASH, Qos())
        # Whatever the hash of the type is, which only the caller knows.
        key = data_key(self._graph.domain, name, kind, "*")
        end = self._session.serve(key, lambda question: self._ask(robot, service, question))
        _log.info("%s (%s) can be called", name, service.kind)

        def close() -> None:
            end()
            opened.close()

        return close

    def _ask(self, robot: int, service: Service, question: Question) -> None:
        attachment = Attachment.parse(question.attachment)
        if attachment is None or not self._leads(robot) or not self._has_room(service):
            self.counts[NOT_TAKEN] += 1
            question.drop()
            return
        number = self._asker.ask(robot, service.name, question.payload, time.monotonic())
        self._asked[number] = _Asked(robot, service.name, question, attachment)
        self._news.set()

    def _has_room(self, service: Service) -> bool:
        """Whether one more call of a kind may be under way."""
        kind = _kind(service.name)
        n = sum(_kind(each.service) == kind for each in self._asked.values())
        return n < (MOST_RESULTS if kind == GET_RESULT else MOST_ASKED)

    def _end(self, ended: Ended) -> None:
        asked = self._asked.pop(ended.number, None)
        if asked is None:
            return
        if ended.status == Status.OK:
            self.counts["calls_answered"] += 1
            attachment = asked.attachment._replace(sent_ns=time.time_ns())
            asked.question.reply(ended.body, attachment.build())
            return
        # ROS has no error for a call. The caller's own time-out is the error.
        words = WORDS.get(ended.status, WORDS[Status.OTHER_TYPE])
        self.counts["calls_failed"] += 1
        _log.warning("%s: %s", at_robot(asked.robot, asked.service), words)
        asked.question.drop()


def _bus_name(robot: int) -> str:
    return f"/{calls_name(robot)}"


def _kind(service: str) -> str:
    """The end of the name by which calls differ in how long they take; empty for most."""
    return next((each for each in (GET_RESULT, CANCEL_GOAL) if service.endswith(each)), "")
