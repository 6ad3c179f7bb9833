"""The gateway: joins one daemon's robots to a fleet on Zenoh."""

import asyncio
import logging
import time
from collections.abc import Callable, Coroutine
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
from sdrlinkd.fleet.election import Election, score
from sdrlinkd.fleet.formats import encode, read_claim
from sdrlinkd.fleet.forwarding import Forwarding
from sdrlinkd.fleet.heard_robot import HeardRobot
from sdrlinkd.fleet.keys import Keys
from sdrlinkd.fleet.other_gateways import OtherGateways
from sdrlinkd.fleet.report import BRIDGE, DOWN, UP, Counts, GatewayReport
from sdrlinkd.fleet.session import Answer, Sample, Session, open_session
from sdrlinkd.fleet.upward import SETTLED_S, UpwardMessages
from sdrlinkd.reports import NeighborReport, Snapshot

TICK_S = 0.05
PRESENT_S = 3.0
"""Time in s after which a robot that is silent is not heard any more."""
FORGOTTEN_S = 30.0
OTHERS_S = 0.2
"""Time in s for which a gateway leaves it to the leaders to put last messages again."""

_log = logging.getLogger(__name__)


class Gateway:
    """Everything that one gateway knows, on one event loop."""

    def __init__(self, setup: Setup, session: Session) -> None:
        params = setup.config.fleet
        self._setup = setup
        self._session = session
        self._directory = setup.config.bus.runtime_dir or None
        self._daemon = DaemonSide(self._directory)
        self._own_id = setup.node_id
        self._lease_s = params.lease_s
        self._fleet = params.name
        self._keys = Keys(params.name)
        self._robots: dict[int, HeardRobot] = {}
        self._others = OtherGateways(self._own_id)
        self._classes: dict[str, str] = {}
        """Class of each topic, by its name on the air."""
        self._counts = Counts()
        self._up = UpwardMessages(self._own_id, self._keys, params.up, session, self._counts)
        self._down = DownwardCommands(
            self._own_id,
            self._keys,
            params.down,
            session,
            self._counts,
            setup.name_on_bus,
            self._daemon.declare,
        )
        self._bridge = Bridge(
            self._keys,
            params.bridge,
            session,
            self._counts,
            lambda: not self._others.has_bridge_before(self._is_near),
            self._is_near,
            setup.republished,
            self._daemon.declare,
        )
        self._alarm = Alarm(self._do_due)
        self._sending: set[asyncio.Task[None]] = set()

    async def run(self) -> None:
        """Work until cancelled. Raises UserError."""
        keys, session = self._keys, self._session
        session.on_reach = self._note_reach
        session.subscribe(keys.routes, self._claimed)
        session.subscribe(keys.all_sent, lambda each: self._down.told(each, _now()))
        session.watch(keys.gateways, self._note_token)
        session.token(keys.gateway(self._own_id))
        self._serve("status", lambda: msgspec.json.encode(self._daemon.snapshot))
        self._serve("heard", self._heard)
        self._serve("gateway", lambda: msgspec.json.encode(self.report()))
        if self._setup.config.fleet.bridge:
            session.subscribe(keys.all_messages, lambda each: self._bridge.take(each, _now()))
            session.token(keys.bridges(self._own_id))
        async with asyncio.TaskGroup() as group:
            group.create_task(self._daemon.listen(self._take))
            group.create_task(self._daemon.look(self._see))
            group.create_task(self._tick())
            if self._setup.config.fleet.down:
                group.create_task(self._down.follow(self._directory))
            if self._setup.config.fleet.bridge:
                group.create_task(self._bridge.run(self._directory))

    def report(self) -> GatewayReport:
        """The gateway at this moment."""
        counts = self._counts
        return GatewayReport(
            gateway=self._own_id,
            fleet=self._fleet,
            is_reached=self._session.is_reached,
            has_daemon=self._daemon.snapshot is not None,
            others=self._others.ids,
            robots=[each.report() for each in self._robots.values()],
            up=counts.of(UP),
            up_taken=counts["up_taken"],
            up_again=counts["up_again"],
            down=counts.of(DOWN),
            down_taken=counts["down_taken"],
            bridge=counts.of(BRIDGE),
            bridge_taken=counts["bridge_taken"],
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
            self._counts.add("up_taken")
            self._counts.add("up_bridged")
            return
        now, topic = _now(), message.topic.removeprefix(prefix)
        qos = self._classes.get(topic, "default")
        robot = self._robot(message.source)
        robot.heard_at = now
        self._up.take(robot, topic, qos, message, now)
        self._set_alarm()

    def _robot(self, robot: int) -> HeardRobot:
        known = self._robots.get(robot)
        if known is None:
            now = _now()
            election = Election(self._own_id, self._lease_s, now)
            known = HeardRobot(robot, election, Forwarding(), now)
            self._robots[robot] = known
            key = self._keys.messages(robot)
            known.ends = [
                self._session.subscribe(key, lambda each: self._put_by_other(robot, each)),
                self._session.answer(key, lambda _: self._up.answers(robot, _now())),
                self._session.token(self._keys.hears(self._own_id, robot)),
            ]
            _log.info("robot %d is heard", robot)
        return known

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

    def _claimed(self, sample: Sample) -> None:
        robot, claim = self._keys.read_robot(sample.key), read_claim(sample.payload)
        known = None if robot is None else self._robots.get(robot)
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
            for each in self._robots.values() if robot is None else [self._robots.get(robot)]:
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
        if self._setup.config.fleet.bridge:
            self._spawn(self._bridge.ask())
        loop = asyncio.get_running_loop()
        loop.call_later(SETTLED_S, lambda: self._put_again(are_led=True))
        loop.call_later(SETTLED_S + OTHERS_S, lambda: self._put_again(are_led=False))

    def _put_again(self, *, are_led: bool) -> None:
        """Put again what was not put while the network was away, first for the robots led."""
        robots = {each.id for each in self._robots.values() if each.election.leads == are_led}
        if self._session.is_reached:
            self._up.put_again(robots, _now())

    def _see(self, snapshot: Snapshot | None) -> None:
        """Take the daemon's report: which robots it hears, and how well."""
        if snapshot is not None:
            self._classes = {
                self._setup.name_on_air(each.name): each.qos for each in snapshot.link.topics
            }
        heard = [] if snapshot is None else snapshot.link.neighbors
        self._note_heard([each for each in heard if not each.is_self], _now())

    def _note_heard(self, neighbors: list[NeighborReport], now: float) -> None:
        scores = {
            each.src: score(each.per if each.per_lately is None else each.per_lately, each.snr_db)
            for each in neighbors
            if each.last_heard_s_ago < PRESENT_S
        }
        for robot in scores:
            self._robot(robot).heard_at = now
        for known in list(self._robots.values()):
            known.election.hear(scores.get(known.id), now)
            if now > known.heard_at + FORGOTTEN_S:
                del self._robots[known.id]
                for end in known.ends:
                    end()
                _log.info("robot %d has not been heard for %d s", known.id, FORGOTTEN_S)

    async def _tick(self) -> None:
        while True:
            now = _now()
            for each in self._robots.values():
                self._lead(each, now)
            await asyncio.sleep(TICK_S)

    def _lead(self, robot: HeardRobot, now: float) -> None:
        """Do this gateway's part in the election for a robot."""
        led, leader = robot.election.leads, robot.election.leader
        robot.forwarding.rank = self._others.rank(robot.id, leader)
        claim = robot.election.poll(now)
        if claim is not None:
            self._session.put(self._keys.route(robot.id), encode(claim), None, "urgent")
        if robot.election.leads and not led:
            _log.info("leads for robot %d", robot.id)
            self._up.put_due(robot, now, all_held=True)

    def _set_alarm(self) -> None:
        """Wake up when something that is held is due."""
        held = (each.forwarding.due_at for each in self._robots.values())
        self._alarm.ring_by(min(held, default=self._down.due_at))
        self._alarm.ring_by(self._down.due_at)

    def _do_due(self) -> None:
        now = _now()
        for robot in self._robots.values():
            self._up.put_due(robot, now)
        for order in self._down.take_due(now):
            self._spawn(self._down.send(order, now))
        self._set_alarm()

    def _spawn(self, work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.get_running_loop().create_task(work)
        self._sending.add(task)
        task.add_done_callback(self._sending.discard)

    def _is_near(self, robot: int) -> bool:
        """Whether a robot is on the air of this gateway's daemon."""
        known = self._robots.get(robot)
        return robot == self._own_id or (known is not None and known.election.score is not None)

    def _heard(self) -> bytes:
        snapshot = self._daemon.snapshot
        neighbors = [] if snapshot is None else snapshot.link.neighbors
        return msgspec.json.encode([each for each in neighbors if not each.is_self])


def _now() -> float:
    return time.monotonic()


async def run_gateway(setup: Setup, folder: Path) -> None:
    """Run a gateway until cancelled; file names are relative to `folder`. Raises UserError."""
    session = await open_session(setup.config.fleet, folder)
    try:
        with ungrouped():
            await Gateway(setup, session).run()
    finally:
        await session.close()
