"""Octets from the air against their type: only what can be a message of it reaches DDS.

A length that exceeds the message, or a text that is none, must not meet the deserializer of every
node here. The check follows the fields in the words of `get_fields_and_field_types`. Parts of fixed
size are stepped over together, so the time grows with the number of texts and sequences inside,
not with the number of octets.
"""

import re
import struct
from collections.abc import Callable
from typing import NamedTuple

Fields = dict[str, str]
FieldsOf = Callable[[str], Fields]
Fits = Callable[[bytes], bool]

MOST_PARTS = 1 << 18
"""Texts and other parts of variable size in one message; more take too long to look at."""
MOST_PADDING = 3
"""Octets behind a message, up to the next multiple of four."""
_SIZES = {
    "octet": 1, "byte": 1, "char": 1, "uint8": 1, "int8": 1, "uint16": 2, "int16": 2, "wchar": 2,
    "uint32": 4, "int32": 4, "float": 4, "uint64": 8, "int64": 8, "double": 8, "long double": 16,
}  # fmt: skip
_ALIGNED = 8
_PHASES = range(_ALIGNED)
_ENCAPSULATION = 4
_BIG, _LITTLE = b"\0\0", b"\0\1"
_LENGTHS = {_BIG: struct.Struct(">I"), _LITTLE: struct.Struct("<I")}
_ENDLESS = 1 << 32
_SEQUENCE = re.compile(r"sequence<(.+?)(?:, (\d+))?>")
_ARRAY = re.compile(r"(.+)\[(\d+)\]")
_TEXT = re.compile(r"(w?)string(?:<(\d+)>)?")


class _Body:
    """The octets of a message behind its encapsulation."""

    def __init__(self, octets: bytes, length: struct.Struct, wide: int) -> None:
        self.octets = octets
        self.end = len(octets)
        self.wide = wide
        self._length = length
        self._parts = MOST_PARTS

    def length(self, at: int, most: int) -> tuple[int, int]:
        """(a number of parts of at least an octet each, where they begin). Raises ValueError."""
        at += -at % 4
        (n,) = self._length.unpack_from(self.octets, at)
        if n > most or n > self.end - at - 4:
            raise ValueError(f"{n} parts at octet {at}")
        return n, at + 4

    def takes(self, parts: int) -> None:
        """Note that so many parts of variable size are looked at. Raises ValueError."""
        self._parts -= parts
        if self._parts < 0:
            raise ValueError(f"more than {MOST_PARTS} parts")


class _Part(NamedTuple):
    """A field, or several in a row.

    `sizes` are its octets with padding, by where it begins modulo 8; None: they depend on what is
    inside. `walk` returns where it ends, or raises ValueError, IndexError or struct.error.
    """

    sizes: tuple[int, ...] | None
    walk: Callable[[_Body, int], int]


def fits(fields: Fields, of: FieldsOf) -> Fits:
    """Tells whether octets are CDR of the type with these fields; `of` gives those of others."""
    part = _struct(fields, of)

    def check(octets: bytes) -> bool:
        length = _LENGTHS.get(octets[:2])
        if length is None or len(octets) < _ENCAPSULATION:
            return False
        body = octets[_ENCAPSULATION:]
        return any(_ends(part, _Body(body, length, wide)) for wide in (4, 2))

    return check


def _ends(part: _Part, body: _Body) -> bool:
    """Whether a message ends where its octets do."""
    try:
        at = part.walk(body, 0)
    except (ValueError, IndexError, struct.error):
        return False
    return at <= body.end <= at + MOST_PADDING


def _struct(fields: Fields, of: FieldsOf) -> _Part:
    # A type without fields has one octet.
    return _row([_part(each, of) for each in fields.values()] or [_plain(1)])


def _part(text: str, of: FieldsOf) -> _Part:
    if (size := _SIZES.get(text)) is not None:
        return _plain(size)
    if text == "boolean":
        return _Part(None, _boolean)
    if (found := _TEXT.fullmatch(text)) is not None:
        most = int(found[2]) if found[2] else _ENDLESS
        return _Part(None, _wide(most) if found[1] else _text(most))
    if (found := _SEQUENCE.fullmatch(text)) is not None:
        return _sequence(_part(found[1], of), int(found[2]) if found[2] else _ENDLESS)
    if (found := _ARRAY.fullmatch(text)) is not None:
        return _array(_part(found[1], of), int(found[2]))
    return _struct(of(text), of)


def _plain(size: int) -> _Part:
    return _fixed(tuple(-at % min(size, _ALIGNED) + size for at in _PHASES))


def _fixed(sizes: tuple[int, ...]) -> _Part:
    return _Part(sizes, lambda _, at: at + sizes[at % _ALIGNED])


def _row(parts: list[_Part]) -> _Part:
    """Fields in a row; those of fixed size are put together."""
    row: list[_Part] = []
    for part in parts:
        if row and part.sizes is not None and (before := row[-1].sizes) is not None:
            row[-1] = _fixed(
                tuple(before[at] + part.sizes[(at + before[at]) % _ALIGNED] for at in _PHASES)
            )
        else:
            row.append(part)
    if len(row) == 1:
        return row[0]
    walks = [each.walk for each in row]

    def walk(body: _Body, at: int) -> int:
        for each in walks:
            at = each(body, at)
        return at

    return _Part(None, walk)


def _array(part: _Part, n: int) -> _Part:
    sizes = part.sizes
    if sizes is not None:
        return _fixed(tuple(_behind(sizes, n, at) - at for at in _PHASES))

    def walk(body: _Body, at: int) -> int:
        body.takes(n)
        for _ in range(n):
            at = part.walk(body, at)
        return at

    return _Part(None, walk)


def _sequence(part: _Part, most: int) -> _Part:
    sizes = part.sizes

    def walk(body: _Body, at: int) -> int:
        n, at = body.length(at, most)
        if sizes is not None:
            return _behind(sizes, n, at)
        body.takes(n)
        for _ in range(n):
            at = part.walk(body, at)
        return at

    return _Part(None, walk)


def _behind(sizes: tuple[int, ...], n: int, at: int) -> int:
    """The end of `n` parts of fixed sizes that begin at `at`.

    After at most eight of them, one begins like an earlier one, and all repeats.
    """
    first: dict[int, tuple[int, int]] = {}
    left = n
    while left and at % _ALIGNED not in first:
        first[at % _ALIGNED] = left, at
        at += sizes[at % _ALIGNED]
        left -= 1
    if left:
        then, began = first[at % _ALIGNED]
        times, left = divmod(left, then - left)
        at += times * (at - began)
    for _ in range(left):
        at += sizes[at % _ALIGNED]
    return at


def _boolean(body: _Body, at: int) -> int:
    if body.octets[at] > 1:
        raise ValueError(f"neither true nor false at octet {at}")
    return at + 1


def _text(most: int) -> Callable[[_Body, int], int]:
    def walk(body: _Body, at: int) -> int:
        # Its length counts the NUL at its end.
        n, at = body.length(at, most + 1)
        if n:
            if body.octets[at + n - 1]:
                raise ValueError(f"a text without end at octet {at}")
            body.octets[at : at + n - 1].decode()
        return at + n

    return walk


def _wide(most: int) -> Callable[[_Body, int], int]:
    """A text of wide characters, for which middleware has two or four octets each."""

    def walk(body: _Body, at: int) -> int:
        n, at = body.length(at, most)
        return at + n * body.wide

    return walk
