"""The job of an endpoint, and the interface of a transport.

Everything that an endpoint imports is in the standard library: some peers need an interpreter of
their own, without our packages.
"""

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import NamedTuple, Protocol

Hear = Callable[[bytes, float], None]
"""Takes a complete message, and the time at which it was complete (monotonic s)."""

CONTACT_S = 20.0
"""Time in which both ends must find each other."""


class NoContactError(Exception):
    """The ends did not find each other; the message says which part failed."""


class Topic(NamedTuple):
    """One flow, as endpoints know it."""

    number: int
    name: str
    size: int
    qos: str
    sender: str
    """The side that sends it: "a" or "b"."""


class Loop(NamedTuple):
    """The control loop: x(k+1) = A x(k) + b u(k), y = x0; u = gain (setpoint - y)."""

    tick_s: float
    ticks: int
    every: int
    """Number of ticks from one y to the next."""
    a: list[list[float]]
    b: list[float]
    gain: float
    setpoint: float


@dataclass(frozen=True)
class Job:
    """One end's part in an experiment."""

    peer: str
    side: str
    here: str
    there: str
    rate_bps: float
    """Channel capacity of one node, for peers that pace."""
    topics: list[Topic]
    sends: list[tuple[float, int, int]]
    """This end's schedule: s after the start, topic's number, message's number."""
    seconds: float
    """Time after the start at which this end stops, whatever happens."""
    loop: Loop | None = None
    """In the control loop "a" is the plant, "b" the controller; topics 0 and 1 are y and u."""

    @property
    def out(self) -> list[Topic]:
        """The topics that this end sends."""
        return [topic for topic in self.topics if topic.sender == self.side]

    @property
    def into(self) -> list[Topic]:
        """The topics that it hears."""
        return [topic for topic in self.topics if topic.sender != self.side]

    def to_json(self) -> str:
        """The job as JSON on one line."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> "Job":
        """The job that `to_json` put on a line."""
        told = json.loads(text)
        told["topics"] = [Topic(*topic) for topic in told["topics"]]
        told["sends"] = [tuple(send) for send in told["sends"]]
        told["loop"] = told["loop"] and Loop(*told["loop"])
        return cls(**told)


class Transport(Protocol):
    """One end of a peer. Received messages are passed to the `Hear` it was opened with."""

    def meet(self) -> None:
        """Wait until all topics are connected; raises NoContactError."""

    def send(self, topic: int, message: bytes) -> None:
        """Send a message, as a publisher does."""

    def run(self, until: float) -> None:
        """Move bytes until that time (monotonic s)."""

    def close(self) -> None:
        """Release everything that was opened."""
