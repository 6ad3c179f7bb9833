"""Topics beyond the registry, and parts of large messages: entries of topic id 0xE.

Wire document, section 4.4. Each fragment begins with an octet: the number of a topic that its
source declares, or 0 for a part of a large message. In memory a declared topic's id is its number,
and that of parts is PARTS.
"""

import hashlib
import struct
from typing import NamedTuple

from sdrlinkd.errors import PduError
from sdrlinkd.wire.capacity import MAX_FRAGMENTS, equal_payload
from sdrlinkd.wire.origin import read_origin
from sdrlinkd.wire.registry import DECLARED_TOPIC_ID, is_topic_name, topic_type

FIRST_NUMBER = 16
LAST_NUMBER = 255
PARTS = 0x100 | DECLARED_TOPIC_ID
"""Topic id in memory of parts of large messages; in control records its octet is 0x0E."""
MAX_PARTS = 255
PART_PARITY = 0.1
"""Least share of parity fragments of a part."""
MAX_CODED = 256
"""Most fragments and parity fragments together, of a message or a part."""
_PART_HEADER = struct.Struct(">BHBB")
PART_HEADER_SIZE = _PART_HEADER.size
HASH_SIZE = 8
MAX_PIECES = 15
_PIECE = struct.Struct(">BHB")
_ABOUT = struct.Struct(f">BB{HASH_SIZE}s")
_LATCHED, _BEST_EFFORT = 0x01, 0x02
MAX_NAME = 128
"""Longest name, and longest type, of a declared topic in octets."""


def octet(topic_id: int) -> int:
    """The octet that stands for a topic in control records."""
    return topic_id & 0xFF


def number_octet(topic_id: int) -> bytes:
    """What stands ahead of each fragment of a topic beyond 0xF."""
    if topic_id == PARTS:
        return b"\0"
    if not FIRST_NUMBER <= topic_id <= LAST_NUMBER:
        raise ValueError(f"topic number {topic_id}; allowed: {FIRST_NUMBER} to {LAST_NUMBER}")
    return bytes((topic_id,))


def overhead(topic_id: int) -> int:
    """Octets of each fragment that are not the message's: 1 for topic id 0xE, else 0."""
    return int(topic_id > 0xF)


def part_size(pdu_size: int, share: float = PART_PARITY) -> int:
    """Octets of a large message in each part but the last, for a share of parity fragments."""
    fragments = int(MAX_CODED / (1 + max(PART_PARITY, share)))
    return fragments * (equal_payload(pdu_size, 1) - 1) - PART_HEADER_SIZE


def max_large_size(pdu_size: int, share: float = PART_PARITY) -> int:
    """Largest message that can be sent in parts."""
    return MAX_PARTS * part_size(pdu_size, share)


class Part(NamedTuple):
    """A part of the large message `number` of a topic, which has `parts` parts."""

    topic_id: int
    number: int
    part: int
    parts: int
    data: bytes


def build_part(part: Part) -> bytes:
    """The octets of a part. Raises ValueError if a field is out of range."""
    try:
        return _PART_HEADER.pack(*part[:4]) + part.data
    except struct.error as error:
        raise ValueError(f"{part[:4]} does not fit a part: {error}") from None


def parse_part(octets: bytes) -> Part | None:
    """The part in the octets of a message under number 0; None if it is not one."""
    if len(octets) <= PART_HEADER_SIZE:
        return None
    part = Part._make((*_PART_HEADER.unpack_from(octets), octets[PART_HEADER_SIZE:]))
    is_topic = part.topic_id < DECLARED_TOPIC_ID or part.topic_id >= FIRST_NUMBER
    return part if is_topic and part.part < part.parts else None


class TopicPiece(NamedTuple):
    """TOPIC record: a piece of the description of a declared topic (wire document, 6.9).

    `check` is the first two octets of SHA-256 over the whole description, in `pieces` pieces.
    """

    number: int
    check: int
    piece: int
    pieces: int
    data: bytes


class Description(NamedTuple):
    """What a robot declares of a topic: `name` without leading slash, `type` as `pkg/msg/Name`.

    `hash_` is the beginning of the type's RIHS01 hash, zeros if unknown. With `depth` above 0,
    receivers keep that many messages for late consumers (transient_local).
    """

    name: str
    type: str
    hash_: bytes = bytes(HASH_SIZE)
    depth: int = 0
    is_best_effort: bool = False


def build_topic(piece: TopicPiece) -> bytes:
    """The value of a TOPIC record. Raises ValueError or struct.error if a field is out of range."""
    number, check, at, n, data = piece
    if n > 0xF:
        raise ValueError(f"piece {at} of {n} of topic {number} does not fit its record")
    return _PIECE.pack(number, check, at << 4 | n) + data


def parse_topic(value: bytes) -> TopicPiece:
    """The piece in the value of a TOPIC record of at least four octets."""
    number, check, at_n = _PIECE.unpack_from(value)
    return TopicPiece(number, check, at_n >> 4, at_n & 0x0F, value[_PIECE.size :])


def pieces(number: int, about: Description, room: int) -> list[TopicPiece]:
    """The pieces of a description, of at most `room` octets each.

    Raises ValueError if it does not fit into 15 of them.
    """
    flags = _LATCHED * (about.depth > 0) | _BEST_EFFORT * about.is_best_effort
    octets = _ABOUT.pack(flags, min(about.depth, 0xFF), about.hash_)
    octets += f"{about.name}\0{about.type}".encode()
    n = -(-len(octets) // max(1, room))
    if n > MAX_PIECES:
        raise ValueError(f"{about.name}: {len(octets)} octets in pieces of {room}")
    check = _check(octets)
    cut = (octets[i * room : (i + 1) * room] for i in range(n))
    return [TopicPiece(number, check, i, n, each) for i, each in enumerate(cut)]


def parse_description(octets: bytes, check: int) -> Description:
    """The description whose joined pieces are `octets`. Raises PduError if it is none."""
    if _check(octets) != check or len(octets) < _ABOUT.size:
        raise PduError("rx_control_bad", "the pieces of a TOPIC do not belong together")
    flags, depth, hash_ = _ABOUT.unpack_from(octets)
    name, _, kind = octets[_ABOUT.size :].decode(errors="replace").partition("\0")
    if not is_topic_name(read_origin(name).name) or len(name) > MAX_NAME:
        raise PduError("rx_control_bad", f"{name[:MAX_NAME]!r} is no topic name")
    known = topic_type(kind)
    if known is None or len(kind) > MAX_NAME:
        raise PduError("rx_control_bad", f"{name}: {kind[:MAX_NAME]!r} is no message type")
    depth = max(1, depth) if flags & _LATCHED else 0
    name = name.removeprefix("/")
    return Description(name, known, hash_, depth, bool(flags & _BEST_EFFORT))


def _check(octets: bytes) -> int:
    return int.from_bytes(hashlib.sha256(octets).digest()[:2], "big")


def max_size(pdu_size: int, topic_id: int) -> int:
    """Largest message of a topic that needs no parts."""
    return MAX_FRAGMENTS * (equal_payload(pdu_size, 1) - overhead(topic_id))
