"""The packets of which calls consist, as octets on the bus."""

import struct
from enum import IntEnum
from math import inf
from typing import NamedTuple

ENCAPSULATION = b"\0\1\0\0"
_HEAD = struct.Struct(">BBIIfB")
GET_RESULT = "/_action/get_result"
"""End of the names of services that bring the results of actions, which may take long."""
CANCEL_GOAL = "/_action/cancel_goal"
_GOAL = slice(4, 20)
"""Where the request to cancel has the goal's UUID."""
MOST_KEPT = 256
"""Calls of one robot that are running or answered at a time."""


class Kind(IntEnum):
    """What a packet is."""

    REQUEST = 1
    TAKEN = 2
    ANSWER = 3
    ACK = 4


class Status(IntEnum):
    """How a call has ended."""

    OK = 0
    NO_SERVER = 1
    SERVER_ENDED = 2
    OTHER_TYPE = 3
    RESTARTED = 4
    BUSY = 5
    TOO_LARGE = 6
    TIMED_OUT = 100


WORDS: dict[int, str] = {
    Status.NO_SERVER: "no server offers it there, or services.allow does not name it",
    Status.SERVER_ENDED: "its server ended during the call",
    Status.OTHER_TYPE: "its type has other fields there; install the same version at both robots",
    Status.RESTARTED: "the bridge there has restarted since, or the call is very old; it may "
    "or may not have been executed",
    Status.BUSY: f"{MOST_KEPT} calls are running there",
    Status.TOO_LARGE: "its request or its answer is too large for the link",
    Status.TIMED_OUT: "no answer came in time",
}
"""Why a call has no answer."""


class Packet(NamedTuple):
    """One message of a call. `age_s` is the request's age at its bridge."""

    kind: Kind
    boot: int
    number: int
    name: str = ""
    status: int = Status.OK
    age_s: float = 0.0
    body: bytes = b""

    @property
    def is_long(self) -> bool:
        """Whether it asks for the result of an action, or cancels one goal of it.

        Both may be asked for as long as the goal lasts, also over an outage. Who cancels all goals
        means those of now.
        """
        return self.name.endswith(GET_RESULT) or (self.is_cancel and any(self.body[_GOAL]))

    @property
    def is_cancel(self) -> bool:
        """Whether it cancels goals of an action."""
        return self.name.endswith(CANCEL_GOAL)

    def build(self) -> bytes:
        """Its octets on the bus."""
        name = self.name.encode()
        head = _HEAD.pack(self.kind, self.status, self.boot, self.number, self.age_s, len(name))
        return ENCAPSULATION + head + name + self.body

    @classmethod
    def parse(cls, octets: bytes) -> "Packet | None":
        """The packet in these octets; None if they are none."""
        at = len(ENCAPSULATION) + _HEAD.size
        if len(octets) < at or not octets.startswith(ENCAPSULATION):
            return None
        kind, status, boot, number, age_s, length = _HEAD.unpack_from(octets, len(ENCAPSULATION))
        name = octets[at : at + length]
        if kind not in iter(Kind) or len(name) < length or not 0 <= age_s < inf:
            return None
        try:
            text = name.decode()
        except UnicodeDecodeError:
            return None
        body = octets[at + length :]
        return cls(Kind(kind), boot, number, text, status, age_s, body)
