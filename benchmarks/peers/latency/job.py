"""What an endpoint is told, what its messages look like, and what a transport does for it."""

import json
import struct
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import NamedTuple, Protocol

from benchmarks.peers.latency.clock import Clock

REQUEST, REPLY = 0, 1
"""The kinds of time synchronisation."""
FIRST_TOPIC = 2
"""Kinds from here on are topics."""
MOST_TOPICS = 15

ASKED = struct.Struct("<q")
"""A request: when it was sent (t1, ns, the asker's clock)."""
ANSWERED = struct.Struct("<qqq")
"""A reply: t1; when the request came (t2) and this was sent (t3; ns, the answerer's clock)."""
STAMP = struct.Struct("<dI")
"""A topic's message begins with when it was created (s, the sender's clock) and its number."""


class Transport(Protocol):
    """One end of a peer. Payloads of the kinds below `FIRST_TOPIC` are as above."""

    def send(self, kind: int, payload: bytes) -> None:
        """Take a message; what cannot be taken is dropped."""

    def receive(self, timeout_s: float) -> Iterable[tuple[int, bytes]]:
        """Wait so long for messages, and tell them one by one, each as soon as it is parsed."""


class Address(NamedTuple):
    """A transport's end: by which name it is opened, and where."""

    transport: str
    """A name that `transports.open_transport` knows."""
    place: str
    """A device, a port, a folder: the transport's own."""


@dataclass(frozen=True)
class Job:
    """What one end has to do."""

    side: str
    """ "companion" or "fcu"."""
    address: Address
    clock: Clock
    rate_hz: float
    """Of each topic."""
    size: int
    """Bytes of each message's payload."""
    n_topics: int
    warmup_s: float
    """Everything is sent, but nothing counts; time synchronisation goes faster."""
    seconds: float
    """What counts, after the warm-up."""
    seed: int

    @property
    def n_warmup(self) -> int:
        """Messages of each topic that do not count: the first ones."""
        return round(self.warmup_s * self.rate_hz)

    @property
    def n_counted(self) -> int:
        """Messages of each topic that count."""
        return round(self.seconds * self.rate_hz)

    def to_json(self) -> str:
        """The job as JSON on one line."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> "Job":
        """The job that `to_json` put on a line."""
        told = json.loads(text)
        told["address"] = Address(*told["address"])
        told["clock"] = Clock(*told["clock"])
        return cls(**told)
