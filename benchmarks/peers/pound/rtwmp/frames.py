"""Frames of RT-WMP and their sizes in octets."""

from enum import Enum
from math import ceil
from struct import Struct
from typing import NamedTuple

HEADER = Struct("<bbQBBbbbIHHiBI")
"""Signal, noise, serial, network, kind, from, to, retries, acknowledged by, loop, burst, sleep,
waiting, flow control: in the order of the program, with its 64-bit serial."""
TOKEN = Struct("<BbbIHh")
"""Beginner, highest priority, its holder, its age, message and part acknowledged. The LQM follows,
an octet for each pair; on its diagonal is each node's state: reached, lost."""
AUTHORIZATION = Struct("<BBIIIHh")
"""Kind, source, destination, reached, age, message and part acknowledged."""
MESSAGE = Struct("<BBIIIHHhHBb")
"""Kind, source, destinations, reached, age, message, part size, part, octets, port, priority."""
DROP = Struct("<Q")
"""The serial of the frame that is dropped."""

MTU = 1500
PART = MTU - HEADER.size - MESSAGE.size - 60
"""Octets of a message in one frame: what the program leaves of the MTU."""


class Kind(Enum):
    """What a frame is."""

    TOKEN = "token"
    AUTHORIZATION = "authorization"
    MESSAGE = "message"
    DROP = "drop"


class Message(NamedTuple):
    """Number `number` of node `src`, with `octets` octets, from time `at` in s."""

    number: int
    src: int
    dst: int
    octets: int
    priority: int
    """127 is the most important."""
    at: float

    def parts(self, part_octets: int) -> int:
        """How many parts the message goes in."""
        return max(1, ceil(self.octets / part_octets))


class Claim(NamedTuple):
    """The most important message that a token has found so far."""

    priority: int
    age_s: float
    holder: int


class Ack(NamedTuple):
    """The part that the last loop delivered."""

    src: int
    number: int
    part: int


class Token(NamedTuple):
    """The body of a token."""

    beginner: int
    claim: Claim | None
    reached: frozenset[int]
    lost: frozenset[int]
    lqm: tuple[tuple[float, ...], ...]
    """Row i has how well node i hears each other node, in per cent."""
    ack: Ack | None
    returning: bool = False
    """All are reached, and the token goes back to its beginner."""


class Authorization(NamedTuple):
    """The body of an authorization to node `dst`."""

    dst: int
    reached: frozenset[int]


class Part(NamedTuple):
    """The body of a message's frame; `octets` of them are the message's."""

    message: Message
    part: int
    octets: int
    reached: frozenset[int]


class Drop(NamedTuple):
    """The body of an answer to a frame that is too old."""

    serial: int


Body = Token | Authorization | Part | Drop


class Frame(NamedTuple):
    """A frame on the air. Every new frame has a higher serial than all before it."""

    serial: int
    sender: int
    to: int
    loop: int
    body: Body
    retry: bool = False

    @property
    def kind(self) -> Kind:
        """What the frame is."""
        return _KINDS[type(self.body)]


_KINDS: dict[type, Kind] = {
    Token: Kind.TOKEN, Authorization: Kind.AUTHORIZATION, Part: Kind.MESSAGE, Drop: Kind.DROP,
}  # fmt: skip


def size(body: Body, n_nodes: int) -> int:
    """Octets of a frame in a network of `n_nodes`."""
    match body:
        case Token():
            return HEADER.size + TOKEN.size + n_nodes * n_nodes
        case Authorization():
            return HEADER.size + AUTHORIZATION.size
        case Part():
            return HEADER.size + MESSAGE.size + body.octets
        case Drop():
            return HEADER.size + DROP.size
