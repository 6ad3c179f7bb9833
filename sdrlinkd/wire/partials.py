"""What a receiver holds of messages that are not complete yet."""

from collections import OrderedDict
from dataclasses import dataclass, field
from typing import NamedTuple

# Memory in bytes counted for an incomplete message besides its payload, so that tiny ones count.
PARTIAL_OVERHEAD = 512
FRAGMENT_OVERHEAD = 128
NO_ENTRY = -1
OVERTAKEN = 4
"""Timeouts after which a large message is given up if a later one of its topic has begun."""


@dataclass(frozen=True, slots=True)
class ReassemblyLimits:
    """How long, and in how much memory, the receiver keeps incomplete messages."""

    timeout_s: float = 1.0
    """Time in s without a new fragment after which a message is given up."""
    source_bytes: int = 12 << 20
    """Largest memory for one source in bytes, including overhead."""
    total_bytes: int = 48 << 20
    """Largest memory for all sources together in bytes, including overhead."""


class Lost(NamedTuple):
    """An incomplete message that was given up, and the ledger's reason.

    A large message has topic id and entry id of its last part in `stamped`, if that has arrived.
    """

    src: int
    topic_id: int
    stamped: tuple[int, int]
    reason: str


class Joined(NamedTuple):
    """A large message that is complete, and the entry id of its last part."""

    topic_id: int
    payload: bytes
    entry_id: int
    number: int
    """Its number among the large messages of its topic."""


@dataclass(slots=True)
class Partial:
    """An incomplete message, with its fragments by number."""

    total: int
    touched_at: float
    began_at: float
    parts: dict[int, bytes] = field(default_factory=dict)
    cost: int = PARTIAL_OVERHEAD
    shape: tuple[int, int, int] | None = None
    """(number of parity fragments, octets of a fragment, octets of the message) of the parity."""
    parity: dict[int, dict[int, bytes]] = field(default_factory=dict)
    """Pieces of parity fragments, by offset and then by number."""
    pdus: tuple[int, int] = (0, 0)
    """Numbers of the first and the last PDU with something of the message."""
    is_sealed: bool = True
    """Whether all of these PDUs were sealed."""

    def note_pdu(self, number: int, *, is_sealed: bool) -> None:
        """Note the number of another PDU with something of the message."""
        first, last = self.pdus
        self.pdus = min(first, number), max(last, number)
        self.is_sealed = self.is_sealed and is_sealed


@dataclass(slots=True)
class Large:
    """An incomplete large message, with its parts by number."""

    n_parts: int
    began_at: float
    touched_at: float
    parts: dict[int, bytes] = field(default_factory=dict)
    entry_id: int = NO_ENTRY
    """Entry id of the last part; NO_ENTRY until that is there."""
    cost: int = PARTIAL_OVERHEAD
    is_sealed: bool = True
    is_overtaken: bool = False
    """Whether a part of a later message of the topic has come."""


@dataclass(slots=True)
class Source:
    """What is held of one source; in both tables, the one silent for longest is first."""

    partials: OrderedDict[tuple[int, int], Partial] = field(default_factory=OrderedDict)
    large: OrderedDict[tuple[int, int], Large] = field(default_factory=OrderedDict)
    parts_at: float = float("-inf")
    """When a fragment of any part came last."""
    cost: int = 0
