"""What gateways, operators and consumers tell each other (fleet document, sections 2, 4 and 5).

All of it comes from a network: what cannot be read is None, never an exception.
"""

from math import isnan
from typing import Annotated, Literal, TypeVar

import msgspec
from msgspec import Meta

from sdrlinkd.client import MessageName

T = TypeVar("T")
TERMS = 1 << 32
MOST_OCTETS = 1024
"""Largest attachment in octets that is read."""
Gateway = Annotated[int, Meta(ge=0, le=254)]
Number = Annotated[int, Meta(ge=0, le=1 << 53)]
Term = Annotated[int, Meta(ge=0, lt=TERMS)]
Time = Annotated[int, Meta(ge=0, le=(1 << 63) - 1)]
Text = Annotated[str, Meta(max_length=128)]
Qos = Literal["", "urgent", "latency", "default", "bulk"]
"""A class; empty: that of the topic."""


class Passed(msgspec.Struct, frozen=True, omit_defaults=True):
    """The attachment of a message that a gateway has put."""

    gw: Gateway
    ty: Text = ""
    b: Number | None = None
    e: Number | None = None
    pn: Number | None = None
    sq: Number | None = None
    ps: Number = 0
    sr: Number = 0
    age: Number | None = None
    tl: Time | None = None
    eb: Number | None = None
    sn: float | None = None
    h: Number = 0
    stop: bool = False
    again: bool = False

    @property
    def name(self) -> MessageName | None:
        """The message's name; None if it has none."""
        first_pdu = self.sq if self.pn is None else self.pn
        if self.e is None or first_pdu is None:
            return None
        return MessageName(self.b, self.e, first_pdu, self.ps, self.pn is not None)


class Command(msgspec.Struct, frozen=True, omit_defaults=True):
    """The attachment of a command that an operator's program has put."""

    op: Annotated[str, Meta(max_length=32)] = ""
    n: Number | None = None
    ty: Text = ""
    q: Qos = ""
    ls: Annotated[float, Meta(gt=0)] | None = None


class Claim(msgspec.Struct, frozen=True):
    """A gateway's claim to lead for a robot."""

    gw: Gateway
    term: Term
    score: Annotated[float, Meta(ge=-1, le=2)]

    def beats(self, other: "Claim") -> bool:
        """Whether this one counts, of two claims."""
        if is_later(self.term, other.term) != is_later(other.term, self.term):
            return is_later(self.term, other.term)
        return (self.score, -self.gw) > (other.score, -other.gw)


def is_later(term: int, other: int) -> bool:
    """Whether a term comes after another: they go around (RFC 1982), so that none is the last."""
    return 0 < (term - other) % TERMS <= TERMS // 2


class Fate(msgspec.Struct, frozen=True, omit_defaults=True):
    """What a gateway says of a command that it has taken."""

    gw: Gateway
    topic: Text
    op: Text
    n: Number | None
    fate: Text
    reason: Text = ""


class _Any(msgspec.Struct, frozen=True):
    """An attachment of anybody, read like the others; `gw` is empty unless it has that."""

    gw: msgspec.Raw = msgspec.Raw()


_encode = msgspec.msgpack.Encoder().encode
_passed = msgspec.msgpack.Decoder(Passed)
_command = msgspec.msgpack.Decoder(Command)
_claim = msgspec.msgpack.Decoder(Claim)
_fate = msgspec.msgpack.Decoder(Fate)
_any = msgspec.msgpack.Decoder(_Any)


def encode(told: Passed | Command | Claim | Fate) -> bytes:
    """As MessagePack."""
    return _encode(told)


def is_passed(attachment: bytes | None) -> bool:
    """Whether a message with this attachment comes from a gateway, rather than from an operator."""
    found = _read(_any, attachment)
    return found is not None and bool(found.gw)


def read_passed(attachment: bytes | None) -> Passed | None:
    """The attachment of a gateway's message."""
    return _read(_passed, attachment)


def read_command(attachment: bytes | None) -> Command | None:
    """The attachment of an operator's command; without one, all is as the topic says."""
    return _read(_command, attachment) if attachment else Command()


def read_claim(payload: bytes) -> Claim | None:
    """A gateway's claim."""
    claim = _read(_claim, payload)
    # NaN would be neither better nor worse than any other.
    return None if claim is None or isnan(claim.score) else claim


def read_fate(payload: bytes) -> Fate | None:
    """What a gateway says of a command."""
    return _read(_fate, payload)


def _read(decoder: msgspec.msgpack.Decoder[T], octets: bytes | None) -> T | None:
    if not octets or len(octets) > MOST_OCTETS:
        return None
    try:
        return decoder.decode(octets)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        return None
