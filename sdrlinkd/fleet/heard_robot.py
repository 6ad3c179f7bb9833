"""One robot that a gateway hears: who leads for it, and what is put of it."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

from sdrlinkd.fleet.election import Election
from sdrlinkd.fleet.formats import Passed
from sdrlinkd.fleet.forwarding import Forwarding


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
    ends: list[Callable[[], None]] = field(default_factory=list)
    """Take down what was declared on Zenoh for this robot."""
