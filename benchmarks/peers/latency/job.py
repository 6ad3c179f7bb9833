"""The job of an endpoint, the format of its messages, and the interface of a transport."""

import json
import struct
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import NamedTuple, Protocol

from benchmarks.peers.latency.clock import Clock

REQUEST, REPLY = 0, 1
"""The kinds of time synchronisation messages."""
FIRST_TOPIC = 2
"""Kinds from this on are topics."""
MOST_TOPICS = 15

ASKED = struct.Struct("<q")
"""A request: when it was sent (t1, ns, the asker's clock)."""
ANSWERED = struct.Struct("<qqq")
"""A reply: t1; when the request came (t2) and this was sent (t3; ns, the answerer's clock)."""
STAMP = struct.Struct("<dI")
"""A topic's message begins with when it was created (s, the sender's clock) and its number."""


class Transport(Protocol):
    """One end of a peer. The payloads of kinds below `FIRST_TOPIC` are defined above."""

    def send(self, kind: int, payload: bytes) -> None:
        """Send a message; it is dropped if it cannot be accepted."""

    def receive(self, timeout_s: float) -> Iterable[tuple[int, bytes]]:
        """Wait up to `timeout_s` for messages; yields each as soon as it is parsed."""


class Address(NamedTuple):
    """A transport's end: the name to open it by, and its place."""

    transport: str
    """A name that `transports.open_transport` accepts."""
    place: str
    """A device, a port or a folder, depending on the transport."""


@dataclass(frozen=True)
class Job:
    """The task of one end."""

    side: str
    """ "companion" or "fcu"."""
    address: Address
    clock: Clock
    rate_hz: float
    """Rate of each topic."""
    size: int
    """Bytes of each message's payload."""
    n_topics: int
    warmup_s: float
    """Duration in which messages are sent but not counted; time requests are more frequent."""
    seconds: float
    """Duration that counts, after the warm-up."""
    seed: int

    @property
    def n_warmup(self) -> int:
        """Number of messages of each topic that do not count: the first ones."""
        return round(self.warmup_s * self.rate_hz)

    @property
    def n_counted(self) -> int:
        """Number of messages of each topic that count."""
        return round(self.seconds * self.rate_hz)

    def to_json(self) -> str:
        """The job as JSON on one line."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> "Job":
        """Parse a job from `to_json`."""
        told = json.loads(text)
        told["address"] = Address(*told["address"])
        told["clock"] = Clock(*told["clock"])
        return cls(**told)
