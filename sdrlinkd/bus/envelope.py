"""Bus frames, version 1 (bus document, section 3)."""

from collections.abc import Sequence
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from sdrlinkd.client import MAX_KEY_BYTES
from sdrlinkd.errors import EnvelopeError

VERSION_BYTE = b"\x01"
MAX_HEADER_BYTES = 256
MOST_LOOKED_AT = 16 * MAX_HEADER_BYTES
"""Largest header in octets that is parsed to find the sender of a refused message."""
MOST_SHOWN = 240


class InHeader(msgspec.Struct, frozen=True, gc=False):
    """Header of a message from a producer (bus document, 3.1); unknown fields are ignored."""

    q: Literal["urgent", "latency", "default", "bulk"] | None = None
    p: Annotated[int, Meta(ge=0, le=127)] | None = None
    d: Annotated[int, Meta(ge=0, le=255)] | None = None
    ls: Annotated[float, Meta(gt=0)] | None = None
    t: int | None = None
    ty: str | None = None
    id: str | None = None
    k: str | None = None


class OutHeader(msgspec.Struct, omit_defaults=True, gc=False):
    """Header of a message to consumers (bus document, 3.2)."""

    s: int
    n: int
    tr: int
    ty: str
    g: int = 0
    h: int = 0
    age: int | None = None
    sn: float | None = None
    tl: int | None = None
    eb: int | None = None
    ts: int | None = None
    es: int | None = None
    dw: int | None = None
    dr: int | None = None
    da: int | None = None
    b: int | None = None
    e: int | None = None
    pn: int | None = None
    sq: int | None = None
    ps: int = 0
    stop: bool = False
    late: bool = False
    sr: int | None = None
    v: int | None = None
    se: bool = False


class Receipt(msgspec.Struct, frozen=True, omit_defaults=True):
    """What became of a message at robot `d` (bus document, 4.4).

    `took` is the message's age there in s; `left` is the number of robots that have not answered.
    `repeats` counts the PDUs with parts of the message that were sent again.
    """

    id: str
    topic: str
    d: int
    fate: str
    reason: str = ""
    took: float | None = None
    left: int = 0
    repeats: int = 0


class Taken(msgspec.Struct, frozen=True):
    """A topic that the bus accepts, up to `most` octets.

    `ty` is the message type, `key` the setting that limits the size, and `over` the ledger's reason
    for a larger message.
    """

    ty: str
    most: int
    key: str
    over: str


class Welcome(msgspec.Struct, frozen=True):
    """The announcement to a new subscriber (bus document, 4.1); `boot` is new with each start."""

    daemon: str
    version: str
    envelope: list[int]
    boot: str
    topics: list[str]
    takes: dict[str, Taken]


_from_msgpack = msgspec.msgpack.Decoder(InHeader)
_from_json = msgspec.json.Decoder(InHeader)
_any_msgpack = msgspec.msgpack.Decoder(dict[str, object])
_any_json = msgspec.json.Decoder(dict[str, object])
_to_msgpack = msgspec.msgpack.Encoder()


def decode(frames: Sequence[bytes]) -> tuple[bytes, InHeader | None, bytes]:
    """The envelope in `frames`: (topic with its NUL, header or None if empty, payload).

    Raises EnvelopeError with the cause.
    """
    if len(frames) != 3:
        raise EnvelopeError(f"{len(frames)} frames; an envelope has 3: topic, header, payload")
    topic, header, payload = frames
    if topic[-1:] != b"\0":
        raise EnvelopeError("the topic frame does not end with NUL")
    if header in (b"\x01\x80", b"{}"):
        return topic, None, payload
    if len(header) > MAX_HEADER_BYTES:
        raise EnvelopeError(f"header of {len(header)} bytes; at most {MAX_HEADER_BYTES}")
    try:
        if header[:1] == VERSION_BYTE:
            given = _from_msgpack.decode(header[1:])
        elif header[:1] == b"{":
            given = _from_json.decode(header)
        else:
            raise EnvelopeError(
                f"header begins with {header[:1]!r}; allowed: 0x01 (MessagePack) or {{"
            )
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise EnvelopeError(f"header: {error}") from None
    if given.k is not None and len(given.k.encode(errors="replace")) > MAX_KEY_BYTES:
        raise EnvelopeError(f"header: `k` has more than {MAX_KEY_BYTES} octets")
    return topic, given, payload


def wanted_of(frames: Sequence[bytes]) -> tuple[str, int | None, dict[str, object]]:
    """(receipt id, destination, all header fields) of a message that `decode` refuses.

    A part that cannot be read is "", None or empty.
    """
    fields = fields_of(frames)
    id_, dst = fields.get("id"), fields.get("d")
    return (
        id_ if isinstance(id_, str) and len(id_) <= MAX_HEADER_BYTES else "",
        dst if isinstance(dst, int) and 0 <= dst <= 255 else None,
        fields,
    )


def fields_of(frames: Sequence[bytes]) -> dict[str, object]:
    """All fields in the header of a producer's message; none if it cannot be read."""
    header = frames[1] if len(frames) > 1 else b""
    if len(header) > MOST_LOOKED_AT:
        return {}
    try:
        if header[:1] == VERSION_BYTE:
            return _any_msgpack.decode(header[1:])
        return _any_json.decode(header)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        return {}


def shown(words: str) -> str:
    """Text from another program, or an error that quotes it, made printable and cut to length."""
    plain = "".join(each if each.isprintable() else "?" for each in words[: MOST_SHOWN + 1])
    return plain if len(plain) <= MOST_SHOWN else plain[: MOST_SHOWN - 1] + "…"


def encode(topic: bytes, header: OutHeader, payload: bytes) -> list[bytes]:
    """The three frames of a message to consumers; `topic` has its NUL."""
    return [topic, VERSION_BYTE + _to_msgpack.encode(header), payload]
