"""What ROS 2 nodes on rmw_zenoh see of the robots, and what they send to them."""

import asyncio
import contextlib
import time
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from typing import NamedTuple

from sdrlinkd.adapters import knows
from sdrlinkd.calls import (
    ACTION,
    DIRECTORY,
    FEEDBACK,
    INNER,
    SEND_GOAL,
    STATUS,
    STATUS_TYPE,
    calls_name,
    feedback_type,
    of_action,
)
from sdrlinkd.client import AsyncPublisher, Message, NoDaemonError, RefusedError
from sdrlinkd.config import Setup
from sdrlinkd.daemon_side import DaemonSide
from sdrlinkd.fleet.formats import Command
from sdrlinkd.fleet.heard_robot import HeardRobot, Upward
from sdrlinkd.fleet.keys import TopicKey
from sdrlinkd.fleet.ros.attachment import Attachment
from sdrlinkd.fleet.ros.calls import Calls
from sdrlinkd.fleet.ros.graph import Graph, Opened
from sdrlinkd.fleet.ros.names import Qos, Role, at_robot, read_data_key, robot_in, ros_type
from sdrlinkd.fleet.ros.topics import ENCODING, About, Topics
from sdrlinkd.fleet.samples import Sample
from sdrlinkd.fleet.session import Session
from sdrlinkd.fleet.topics import matches

NOTHING = About()
SETTLED_S = 0.2
"""Time in s, besides the lease, after which no other gateway takes itself for the leader."""
MOST_TAKEN = 256
AGAIN_S = 5.0
"""Time in s after which the daemon is asked again what robots say of their topics."""
LOOK_S = 0.2
"""Shortest time in s between two questions to the daemon."""
MOST_WAITING = 256


class FromRos(NamedTuple):
    """A message of a node to a robot."""

    told: TopicKey
    command: Command


class RosSide:
    """A gateway as a node of a ROS graph in `domain`.

    `leads`: whether it leads for a robot at this moment.
    """

    def __init__(
        self, session: Session, setup: Setup, domain: int, daemon: DaemonSide,
        leads: Callable[[int], bool],
    ) -> None:  # fmt: skip
        own_id, down = setup.node_id, setup.config.fleet.down
        self._session = session
        self._setup = setup
        self._domain = domain
        self._own_id = own_id
        self._down = down
        self._daemon = daemon
        self._graph = Graph(session, domain, own_id)
        self._topics = Topics(self._graph, session)
        self._calls = Calls(self._graph, session, down, daemon, leads)
        self._served_after_s = setup.config.fleet.lease_s + SETTLED_S
        self._about: dict[TopicKey, About] = {}
        """What robots say of their topics."""
        self._waiting: deque[tuple[TopicKey, Upward]] = deque(maxlen=MOST_WAITING)
        """Messages of topics of which a robot has just said something that is not known here."""
        self._is_new = asyncio.Event()
        self._taken: dict[tuple[str, str, str], Opened] = {}
        """The subscriptions that show that nodes' messages go to a robot."""
        self._seen: tuple[frozenset[int], int] = frozenset(), -1

    def start(self) -> None:
        """Appear in the graph."""
        # The first look loads all types, so not when a message has come.
        knows("")
        self._graph.start()

    async def run(self, publisher: AsyncPublisher) -> None:
        """Make calls over the daemon, and learn what robots say of their topics, forever."""
        async with asyncio.TaskGroup() as group:
            group.create_task(self._calls.run(publisher))
            group.create_task(self._learn())

    @property
    def counts(self) -> Mapping[str, int]:
        """Calls by how they ended."""
        return self._calls.counts

    def put(self, told: TopicKey, item: Upward) -> None:
        """Put a message of a robot, as this gateway has put it for others."""
        if INNER in told.topic or item.passed.stop:
            return
        about = self._about_of(told)
        if about is None:
            self._waiting.append((told, item))
            self._is_new.set()
        else:
            self._put(told, item, about)

    def hear(self, robot: int, topic: str, message: Message, *, leads: bool) -> None:
        """Take a message by which the bridges of robots speak to each other."""
        if topic == DIRECTORY:
            self._calls.offer(robot, message.payload)
        elif topic == calls_name(self._own_id):
            self._calls.hear(robot, message.payload)
        elif topic in (FEEDBACK, STATUS) and leads:
            self._put_of_action(robot, topic, message)

    def take_over(self, last: Iterable[tuple[TopicKey, Upward]]) -> None:
        """Put what is latched of a robot for which this gateway leads from now on."""
        for told, item in last:
            if (about := self._about_of(told)) and about.latched:
                self._put(told, item, about)

    def follow(self, robot: int, take: Callable[[FromRos, bytes], None]) -> Callable[[], None]:
        """Call `take` with what nodes send to a robot; returns what ends all that concerns it."""

        def heard(sample: Sample) -> None:
            found = self._read(robot, sample)
            if found is not None:
                take(found, sample.payload)

        key = f"{self._domain}{at_robot(robot, '/**')}"
        end = self._session.subscribe(key, heard) if self._down else None

        def forget() -> None:
            if end is not None:
                end()
            self._topics.close(robot)
            self._calls.forget(robot)

        return forget

    def look(self, robots: Iterable[HeardRobot], now: float) -> None:
        """Serve the services of robots for which this gateway leads, and show what goes to them.

        Only once every other gateway must know who leads: a call must not be made twice.
        """
        served = set()
        for robot in robots:
            if now >= robot.led_since + self._served_after_s:
                served.add(robot.id)
            elif robot.election.leader not in (None, self._own_id):
                # Its leader has all of that.
                self._topics.close(robot.id)
        seen = frozenset(served), self._graph.version
        if seen == self._seen:
            return
        self._seen = seen
        self._calls.serve(served)
        all_wanted = sorted(
            (name, kind, hash_)
            for name, kind, hash_ in self._graph.published()
            if (found := robot_in(name)) and found[0] in served and matches(found[1], self._down)
        )
        wanted = set(all_wanted[:MOST_TAKEN])
        for key in self._taken.keys() - wanted:
            self._taken.pop(key).close()
        for key in wanted - self._taken.keys():
            self._taken[key] = self._graph.open(Role.SUBSCRIPTION, *key, Qos())

    def _about_of(self, told: TopicKey) -> About | None:
        """What is known of a topic; None: nothing yet."""
        topic = self._setup.registry.by_name(told.topic)
        if topic is None:
            return self._about.get(told)
        return About(latched=self._setup.policies[topic.id].latched)

    def _put(self, told: TopicKey, item: Upward, about: About) -> None:
        passed = item.passed
        sent_ns = time.time_ns() - 1_000 * (passed.age or 0) if passed.tl is None else passed.tl
        name, qos = f"/{told.topic}", item.qos
        self._topics.put(told.robot, name, passed.ty, item.payload, sent_ns, qos, about)

    async def _learn(self) -> None:
        """Ask what robots say of their topics when there is a new one."""
        while True:
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._is_new.wait(), AGAIN_S)
            self._is_new.clear()
            with contextlib.suppress(NoDaemonError, RefusedError):
                self._about = {
                    TopicKey(each["robot"], each["name"]): About(
                        each["latched"], each["best_effort"], each["hash"]
                    )
                    for each in await self._daemon.ask("declared")
                }
            for told, item in [self._waiting.popleft() for _ in range(len(self._waiting))]:
                self._put(told, item, self._about.setdefault(told, NOTHING))
            await asyncio.sleep(LOOK_S)

    def _read(self, robot: int, sample: Sample) -> FromRos | None:
        data, attachment = (
            read_data_key(self._domain, sample.key),
            Attachment.parse(sample.attachment),
        )
        if data is None or attachment is None or sample.encoding == ENCODING:
            return None
        found, kind = robot_in(data.name), ros_type(data.kind)
        if found is None or found[0] != robot or not kind or attachment.number < 0:
            return None
        command = Command(attachment.gid.hex(), attachment.number, kind)
        return FromRos(TopicKey(robot, found[1]), command)

    def _put_of_action(self, robot: int, topic: str, message: Message) -> None:
        found = of_action(message.payload)
        service = found and self._calls.offered(robot, f"{found.action}{SEND_GOAL}")
        if found is None or service is None:
            return
        is_status = topic == STATUS
        kind = STATUS_TYPE if is_status else feedback_type(service)
        name = f"{found.action}{ACTION}{topic.removeprefix(INNER)}"
        sent_ns = time.time_ns() - 1_000 * (message.age_us or 0)
        about = About(latched=int(is_status), is_best_effort=not is_status)
        self._topics.put(robot, name, kind, found.cdr, sent_ns, "latency", about)
