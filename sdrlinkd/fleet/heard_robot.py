"""One robot that a gateway hears: who leads for it, and what is put of it."""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf
from typing import NamedTuple

from sdrlinkd.fleet.election import Election
from sdrlinkd.fleet.formats import Passed
from sdrlinkd.fleet.forwarding import Forwarding
from sdrlinkd.fleet.report import RobotHeard


class Upward(NamedTuple):
    """A message to be put, as it came at `at` in s."""

    key: str
    payload: bytes
    passed: Passed
    qos: str
    at: float


@dataclass(slots=True)
class HeardRobot:
    """What a gateway knows of a robot that it hears, or heard a moment ago."""

    id: int
    election: Election
    forwarding: Forwarding[Upward]
    heard_at: float
    led_since: float = inf
    """When this gateway began to lead, in s; inf: it does not."""
    ends: list[Callable[[], None]] = field(default_factory=list)
    """Take down what was declared on Zenoh for this robot."""

    def report(self) -> RobotHeard:
        """The robot at this moment."""
        return RobotHeard(
            robot=self.id,
            leader=self.election.leader,
            score=self.election.score,
            hold_ms=1e3 * self.forwarding.hold_s,
            put_for_others=self.forwarding.put_for_others,
            put_twice=self.forwarding.put_twice,
        )
