"""The gateway: joins one daemon's robots to a fleet on Zenoh."""

import asyncio
import logging
import time
from collections.abc import Callable, Coroutine
from contextlib import closing
from math import inf
from pathlib import Path
from typing import Any

import msgspec

from sdrlinkd.client import Message
from sdrlinkd.config import Setup
from sdrlinkd.daemon_side import DaemonSide
from sdrlinkd.errors import ungrouped
from sdrlinkd.fleet.alarm import Alarm
from sdrlinkd.fleet.bridge import Bridge
from sdrlinkd.fleet.downward import DownwardCommands
from sdrlinkd.fleet.formats import encode, read_claim
from sdrlinkd.fleet.heard_robot import HeardRobot
from sdrlinkd.fleet.heard_robots import HeardRobots
from sdrlinkd.fleet.keys import Keys
from sdrlinkd.fleet.other_gateways import OtherGateways
from sdrlinkd.fleet.own_doors import check_doors
from sdrlinkd.fleet.report import BRIDGE, DOWN, UP, Counts, GatewayReport
from sdrlinkd.fleet.ros import FromRos, RosSide
from sdrlinkd.fleet.samples import Answer, Sample
from sdrlinkd.fleet.session import Session, open_session
from sdrlinkd.fleet.upward import SETTLED_S, UpwardMessages
from sdrlinkd.reports import Snapshot

TICK_S = 0.05
OTHERS_S = 0.2
"""Time in s for which a gateway leaves it to the leaders to put last messages again."""

_log = logging.getLogger(__name__)


class Gateway:
    """Everything that one gateway knows, on one event loop."""

    def __init__(self, setup: Setup, session: Session) -> None:
        params = setup.config.fleet
        self._setup = setup
        self._session = session
        self._daemon = DaemonSide(setup.config.bus.runtime_dir or None)
        self._own_id = setup.node_id
        self._fleet = params.name
        self._keys = Keys(params.name)
        self._robots = HeardRobots(self._own_id, params.lease_s, self._open)
        self._others = OtherGateways(self._own_id)
        self._classes: dict[str, str] = {}
        """Class of each topic, by its name on the air."""
        self._counts = Counts()
        self._up = UpwardMessages(
            self._own_id, self._keys, params.up, session, self._counts,
            lambda topic: self._classes.get(topic, "default"),
        )  # fmt: skip
        self._down = DownwardCommands(
            self._own_id, self._keys, params.down, session, self._counts, setup.name_on_bus,
            self._daemon,
        )  # fmt: skip
        self._bridge = Bridge(
            self._own_id,
            self._keys,
            params.bridge,
            session,
            self._counts,
            lambda: self._others.has_bridge_before(self._robots.is_near),
            self._robots.is_near,
            setup.republished,
            self._daemon,
        )
        self._ros: RosSide | None = None
        if params.ros_domain is not None:
            self._ros = RosSide(session, setup, params.ros_domain, self._daemon, self._leads)
            self._up.on_put = self._ros.put
        self._alarm = Alarm(self._do_due)
        self._sending: set[asyncio.Task[None]] = set()

    async def run(self) -> None:
        """Work until cancelled. Raises UserError."""
        keys, session = self._keys, self._session
        session.on_reach = self._note_reach
        if session.is_reached:
            self._note_reach(is_reached=True)
        session.subscribe(keys.routes, self._claimed)
        session.subscribe(keys.all_sent, lambda each: self._down.told(each, _now()))
        session.watch(keys.gateways, self._note_token)
        session.token(keys.gateway(self._own_id))
        self._serve("status", lambda: msgspec.json.encode(self._daemon.snapshot))
        self._serve("heard", lambda: msgspec.json.encode(self._daemon.neighbors))
        self._serve("gateway", lambda: msgspec.json.encode(self.report()))
        if self._setup.config.fleet.bridge:
            session.subscribe(keys.all_messages, lambda each: self._bridge.take(each, _now()))
            session.token(keys.bridges(self._own_id))
        if self._ros is not None:
            self._ros.start()
        with closing(self._daemon):
            async with self._daemon.publisher() as out, asyncio.TaskGroup() as group:
                group.create_task(self._daemon.listen(self._take))
                group.create_task(self._daemon.look(self._see))
                group.create_task(self._tick())
                if self._setup.config.fleet.down:
                    group.create_task(self._down.follow(out))
                if self._ros is not None:
                    group.create_task(self._ros.run(out))
                if self._setup.config.fleet.bridge:
                    group.create_task(self._bridge.run(out))

    def report(self) -> GatewayReport:
        """The gateway at this moment."""
        counts = self._counts
        return GatewayReport(
            gateway=self._own_id,
            fleet=self._fleet,
            is_reached=self._session.is_reached,
            has_daemon=self._daemon.snapshot is not None,
            others=self._others.ids,
            robots=[each.report() for each in self._robots],
            up=counts.of(UP),
            up_taken=counts["up_taken"],
            up_again=counts["up_again"],
            down=counts.of(DOWN),
            down_taken=counts["down_taken"],
            bridges=self._bridge.sends,
            bridge=counts.of(BRIDGE),
            bridge_taken=counts["bridge_taken"],
            calls={} if self._ros is None else dict(self._ros.counts),
            puts_failed=self._session.failed,
            samples_dropped=self._session.overrun,
            queries_refused=self._session.queries_refused,
        )

    def _take(self, message: Message) -> None:
        prefix = self._setup.republished(message.source, "")
        if message.source == self._own_id or not message.topic.startswith(prefix):
            return
        if message.via is not None:
            # Its own gateway puts it. That nobody else does so makes loops impossible.
            self._up.leave_bridged()
            return
        now, topic = _now(), message.topic.removeprefix(prefix)
        robot = self._robots.heard(message.source, now)
        self._up.take(robot, topic, message, now)
        if self._ros is not None:
            self._ros.hear(robot.id, topic, message, leads=robot.election.leads)
        self._set_alarm()

    def _open(self, robot: int) -> list[Callable[[], None]]:
        """Follow on Zenoh what concerns a robot that is heard from now on."""
        key, session = self._keys.messages(robot), self._session
        ends = [
            session.subscribe(key, lambda each: self._put_by_other(robot, each)),
            session.answer(key, lambda _: self._up.answers(robot, _now())),
            session.token(self._keys.hears(self._own_id, robot)),
        ]
        if self._ros is not None:
            ends.append(self._ros.follow(robot, self._take_from_ros))
        return ends

    def _put_by_other(self, robot: int, sample: Sample) -> None:
        known = self._robots.get(robot)
        if known is None:
            return
        now = _now()
        self._up.passed(known, sample, now)
        if self._setup.config.fleet.down:
            order = self._down.take(sample, known.election.score, now, leads=known.election.leads)
            if order is not None:
                self._spawn(self._down.send(order, now))
        self._set_alarm()

    def _leads(self, robot: int) -> bool:
        """Whether this gateway leads for a robot at this moment."""
        known = self._robots.get(robot)
        return known is not None and known.election.leads

    def _take_from_ros(self, given: FromRos, cdr: bytes) -> None:
        known, now = self._robots.get(given.told.robot), _now()
        if known is not None:
            score, leads = known.election.score, known.election.leads
            order = self._down.take_command(*given, cdr, score, now, leads=leads)
            if order is not None:
                self._spawn(self._down.send(order, now))
            self._set_alarm()

    def _claimed(self, sample: Sample) -> None:
        claim = read_claim(sample.payload)
        known = self._robots.get(self._keys.read_robot(sample.key))
        if known is not None and claim is not None:
            known.election.claimed(claim, _now())

    def _note_token(self, key: str, is_there: bool) -> None:
        token = self._keys.read_token(key)
        if token is None or token.gateway == self._own_id:
            return
        gateway, robot, bridges = token
        self._others.note(token, is_there=is_there)
        if token.is_there:
            _log.info("gateway %d %s", gateway, "is there" if is_there else "has gone")
        if not is_there and not bridges:
            now = _now()
            for each in self._robots if robot is None else [self._robots.get(robot)]:
                if each is not None:
                    each.election.gone(gateway, now)
                    self._lead(each, now)

    def _serve(self, what: str, answer: Callable[[], bytes]) -> None:
        """Answer queries for `what` of this gateway."""
        key = self._keys.gateway(self._own_id, what)
        self._session.answer(key, lambda _: [Answer(key, answer())])

    def _note_reach(self, is_reached: bool) -> None:
        if not is_reached:
            _log.warning("no Zenoh router is reached; messages stay here until one is")
            return
        _log.info("joined fleet %s as gateway %d", self._fleet, self._own_id)
        self._up.reach(_now())
        self._bridge.reach()
        loop = asyncio.get_running_loop()
        loop.call_later(SETTLED_S, lambda: self._put_again(are_led=True))
        loop.call_later(SETTLED_S + OTHERS_S, lambda: self._put_again(are_led=False))

    def _put_again(self, *, are_led: bool) -> None:
        """Put again what was not put while the network was away, first for the robots led."""
        robots = {each.id for each in self._robots if each.election.leads == are_led}
        if self._session.is_reached:
            self._up.put_again(robots, _now())

    def _see(self, snapshot: Snapshot | None) -> None:
        """Take the daemon's report: which robots it hears, and how well."""
        now = _now()
        if snapshot is not None:
            topics = snapshot.link.topics
            self._classes = {self._setup.name_on_air(each.name): each.qos for each in topics}
        self._robots.note(self._daemon.neighbors, now)
        self._bridge.see(snapshot is not None, now)

    async def _tick(self) -> None:
        while True:
            now = _now()
            for each in self._robots:
                self._lead(each, now)
            if self._ros is not None:
                self._ros.look(self._robots, now)
            await asyncio.sleep(TICK_S)

    def _lead(self, robot: HeardRobot, now: float) -> None:
        """Do this gateway's part in the election for a robot."""
        led, leader = robot.election.leads, robot.election.leader
        robot.forwarding.rank = self._others.rank(robot.id, leader)
        claim = robot.election.poll(now)
        if claim is not None:
            self._session.put(self._keys.route(robot.id), encode(claim), None, "urgent")
        if not robot.election.leads:
            robot.led_since = inf
        elif not led:
            robot.led_since = now
            _log.info("leads for robot %d", robot.id)
            self._up.put_due(robot, now, all_held=True)
            if self._ros is not None:
                self._ros.take_over(self._up.last_items(robot.id, now))

    def _set_alarm(self) -> None:
        """Wake up when something that is held is due."""
        self._alarm.ring_by(min(self._robots.due_at, self._down.due_at))

    def _do_due(self) -> None:
        now = _now()
        for robot in self._robots:
            self._up.put_due(robot, now)
        for order in self._down.take_due(now):
            self._spawn(self._down.send(order, now))
        self._set_alarm()

    def _spawn(self, work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.get_running_loop().create_task(work)
        self._sending.add(task)
        task.add_done_callback(self._sending.discard)


def _now() -> float:
    return time.monotonic()


async def run_gateway(setup: Setup, folder: Path) -> None:
    """Run a gateway until cancelled; file names are relative to `folder`. Raises UserError."""
    session = await open_session(setup.config.fleet, folder)
    try:
        await check_doors(session, setup.config.fleet, setup.node_id)
        with ungrouped():
            await Gateway(setup, session).run()
    finally:
        await session.close()
