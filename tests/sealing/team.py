"""A team of links with keys in virtual time, each on a clock of its own, and what is on their air.

`Team.now` is true time in s. A robot's clock starts at its start, as a daemon's does, and drifts.
"""

from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field
from random import Random
from typing import NamedTuple

from sdrlinkd.link import (
    AccessParams,
    Burst,
    ClassesParams,
    ClockParams,
    Link,
    LinkParams,
    Opportunity,
    Outcome,
    PduLinkTraits,
    QueueParams,
    RateParams,
    ReassemblyParams,
    RelayParams,
    RepeatParams,
    TopicPolicy,
)
from sdrlinkd.sealing import Key, Remembered, Sealing, SecurityParams
from sdrlinkd.wire import make_registry

KEY = Key(0, bytes(range(32)))
NEXT = Key(1, bytes(range(32, 64)), follows=True)
SEALED = SecurityParams(mode="seal")
NEW = Remembered({KEY.fingerprint: 0, NEXT.fingerprint: 0})
"""What is on disk of two keys that were never used."""
TOPICS = (("cmd_vel", "geometry_msgs/Twist"), ("odom", "nav_msgs/Odometry"))
LIFESPAN_S = 0.3
STEP_S = 0.005
PDU_S = 0.001
TIMERS_S = 0.05


class Heard(NamedTuple):
    """A message at a robot: when it came, by true time, the age that its link told, its seal."""

    at: float
    src: int
    payload: bytes
    age_s: float | None
    is_sealed: bool


@dataclass
class Robot:
    """One robot; `restart` begins a new life with what is on its disk."""

    id: int
    keys: list[Key]
    params: SecurityParams = SEALED
    relay: RelayParams = field(default_factory=RelayParams)
    hop_limit: int = 1
    access: AccessParams = field(default_factory=AccessParams)
    pdu_size: int = 128
    drift: float = 0.0
    disk: Remembered = NEW
    machine: bytes = b""
    disk_works: bool = True
    heard: list[Heard] = field(default_factory=list)
    lives: int = 0
    is_on: bool = False

    def start(self, now: float) -> None:
        self.lives += 1
        self.is_on = True
        self.began = now
        chance = Random(1000 * self.id + self.lives)
        self.sealing = None
        if self.params.mode != "off":
            keys = [key for key in self.keys if key.fingerprint not in self.disk.retired]
            self.sealing = Sealing(
                self.id,
                self.pdu_size,
                self.params,
                keys,
                self.disk,
                chance.randbytes,
                machine=self.machine,
            )
        self.link = Link(
            LinkParams(pdu_size=self.pdu_size, hop_limit=self.hop_limit),
            QueueParams(),
            ReassemblyParams(),
            make_registry(TOPICS),
            self.id,
            chance,
            classes=ClassesParams(),
            relay=self.relay,
            clock=ClockParams(),
            repeat=RepeatParams(),
            sealing=self.sealing,
        )
        self.link.set_policy(0, TopicPolicy(qos="urgent", lifespan_s=LIFESPAN_S))
        self.write(now)
        traits = PduLinkTraits(
            shares_air=True,
            senses=True,
            longest_burst_s=(0.02,),
            pdu_burst_s=(PDU_S,),
            stamp_s=1e-4,
            react_s=STEP_S,
        )
        self.link.attach(traits, self.access, RateParams())

    def install(self, keys: list[Key]) -> None:
        """Hold other keys from now on, with what is on disk about them."""
        self.keys = keys
        floors = {key.fingerprint: self.disk.floors.get(key.fingerprint, 0) for key in keys}
        self.sealing.install(keys, self.disk._replace(floors=floors))

    def stop(self) -> None:
        self.is_on = False

    def clock(self, now: float) -> float:
        return (now - self.began) * (1 + self.drift)

    def write(self, now: float) -> None:
        if self.sealing is None:
            return
        memory = self.sealing.memory
        wanted = memory.wanted(self.clock(now))
        if wanted is None:
            return
        if self.disk_works:
            self.disk = wanted
            memory.written(wanted)
        else:
            memory.not_written("No space left on device")

    def tick(self, now: float) -> None:
        self.write(now)
        self.link.handle_timers(self.clock(now))

    def hear(self, data: bytes, now: float) -> None:
        at = self.clock(now)
        for message in self.link.hear(data, at, 20.0, at, at):
            age_s = self.link.delivered(message, at)
            self.heard.append(Heard(now, message.src, message.payload, age_s, message.is_sealed))


class Team:
    """Robots on one air, without collisions; `hears(receiver, sender)` says who hears whom.

    `tamper(receiver, data)` sees each PDU on its way, and returns whether it arrives.
    """

    def __init__(self, *robots: Robot, hears: Callable[[int, int], bool] = lambda *_: True) -> None:
        self.robots = {robot.id: robot for robot in robots}
        self.now = 0.0
        self.hears = hears
        self.tamper: Callable[[int, bytes], bool] = lambda *_: True
        self.on_air: list[tuple[float, int, bytes]] = []
        self.later: dict[int, list[tuple[int, bytes]]] = defaultdict(list)
        self.composed: list[Burst] = []
        """All bursts, whether they left or not."""
        self.outcome: Callable[[], Outcome] = lambda: Outcome.SENT
        self._steps = 0
        for robot in robots:
            robot.start(0.0)

    def plays_at(self, at: float, receiver: int, data: bytes) -> None:
        """An attacker plays a PDU to one robot at a time."""
        self.later[round(at / STEP_S)].append((receiver, data))

    def run(self, seconds: float, each_step: Callable[[float], None] = lambda _: None) -> None:
        for _ in range(round(seconds / STEP_S)):
            self._steps += 1
            self.now = self._steps * STEP_S
            each_step(self.now)
            for receiver, data in self.later.pop(self._steps, ()):
                if self.robots[receiver].is_on:
                    self.robots[receiver].hear(data, self.now)
            for robot in self.robots.values():
                if robot.is_on:
                    if self._steps % round(TIMERS_S / STEP_S) == 0:
                        robot.tick(self.now)
                    self._send(robot)

    def _send(self, robot: Robot) -> None:
        clock = robot.clock(self.now)
        if robot.link.next_wakeup(clock) > clock:
            return
        opportunity = Opportunity(
            clock, lambda _, n: n * PDU_S, lambda _, s: min(8, int(min(s, 1.0) / PDU_S))
        )
        burst = robot.link.next_burst(opportunity)
        if burst is None:
            return
        self.composed.append(burst)
        outcome = self.outcome()
        robot.link.confirm(burst, outcome, clock)
        if outcome is not Outcome.SENT:
            return
        for data in burst.pdus:
            self.on_air.append((self.now, robot.id, data))
            for other in self.robots.values():
                if other is robot or not other.is_on or not self.hears(other.id, robot.id):
                    continue
                if self.tamper(other.id, data):
                    other.hear(data, self.now)
