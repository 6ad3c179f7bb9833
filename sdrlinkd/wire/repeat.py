"""PDU numbers, and the records NEED, REPEAT and BARE (wire document, 3.2, 6.13, 6.14, 6.17)."""

import struct
from collections.abc import Iterable
from typing import NamedTuple

PDU_NUMBERS = 1 << 32
"""Count of PDU numbers, which wrap around."""
PDU_NUMBER = struct.Struct(">I")
PDU_NUMBER_SIZE = PDU_NUMBER.size
MAX_BITMAP = 16
"""Most octets of the bitmap in a NEED record."""
REPEAT_UNIT_S = 1e-4
MAX_HELD_REPEAT = 0xFFFF
_NEED = struct.Struct(">BI")
NEED_OVERHEAD = 2 + _NEED.size
"""Octets of a NEED record without its bitmap."""
BARE_BACK = 96
"""How far back a BARE record reaches. A PDU that is made anew has a number a little higher."""
BARE_OVERHEAD = 2 + 1
"""Octets of a BARE record without its bitmap."""
_REPEAT = struct.Struct(">BIHB")
REPEAT_SIZE = 2 + _REPEAT.size
"""Octets of a REPEAT record."""
HELD_AT = 5
"""Offset of the time in the value of a REPEAT record."""


class Need(NamedTuple):
    """NEED record: the sender lacks PDUs of robot `node`.

    Bit 7 of the first octet of `bitmap` stands for PDU `number`, and each further bit for the next.
    """

    node: int
    number: int
    bitmap: bytes

    def numbers(self) -> list[int]:
        """The numbers of the PDUs that are missing."""
        return [each % PDU_NUMBERS for each in _set_bits(self.number, self.bitmap)]


class Repeat(NamedTuple):
    """REPEAT record: `n_pdus` PDUs of robot `node` from `number` on follow in this burst.

    They were sent first `held_100us` units of 0.1 ms before.
    """

    node: int
    number: int
    held_100us: int
    n_pdus: int


class Bare(NamedTuple):
    """BARE record: PDUs of the sender that hold nothing that is sent again.

    Bit 7 of the first octet of `bitmap` stands for the last PDU before with sequence number `seq`,
    and each further bit for the next.
    """

    seq: int
    bitmap: bytes

    def numbers(self, number: int) -> list[int]:
        """The numbers of these PDUs, told in PDU `number`; they may be negative."""
        first = number - 1 - ((number - 1 - self.seq) & 0xFF)
        return [each for each in _set_bits(first, self.bitmap) if each < number]


def bare(numbers: Iterable[int], number: int) -> Bare | None:
    """The BARE record in PDU `number` on the PDUs `numbers` before it; None if there are none.

    What is too far back for the record is left out.
    """
    near = sorted(each for each in numbers if 0 < number - each <= BARE_BACK)
    if not near:
        return None
    bits = sum(1 << (near[-1] - each) for each in near)
    return Bare(near[0] & 0xFF, _bitmap(bits, near[-1] - near[0] + 1))


def needs(node: int, missing: Iterable[int], most: int = MAX_BITMAP) -> list[Need]:
    """NEED records for the PDUs `missing`, in ascending order, of robot `node`.

    Their bitmaps have at most `most` octets.
    """
    found: list[Need] = []
    first, bits, last = 0, 0, -1
    for number in missing:
        if last >= 0 and number - first < 8 * min(most, MAX_BITMAP):
            bits = bits << (number - last) | 1
        else:
            if last >= 0:
                found.append(_need(node, first, bits, last - first + 1))
            first, bits = number, 1
        last = number
    if last >= 0:
        found.append(_need(node, first, bits, last - first + 1))
    return found


def _need(node: int, first: int, bits: int, n_bits: int) -> Need:
    return Need(node, first % PDU_NUMBERS, _bitmap(bits, n_bits))


def _bitmap(bits: int, n_bits: int) -> bytes:
    size = -(-n_bits // 8)
    return (bits << (8 * size - n_bits)).to_bytes(size, "big")


def _set_bits(first: int, bitmap: bytes) -> list[int]:
    """The numbers that the ones in a bitmap stand for; its first bit stands for `first`."""
    bits = int.from_bytes(bitmap, "big")
    last = 8 * len(bitmap) - 1
    return [first + i for i in range(last + 1) if bits >> (last - i) & 1]


def nearest_number(known: int, seq: int) -> int:
    """The number with lowest octet `seq` that is nearest to `known`; it may be negative."""
    return known + ((seq - known + 128) & 0xFF) - 128


def build_need(need: Need) -> bytes:
    """The value of a NEED record. Raises ValueError or struct.error if a field is out of range."""
    if not 1 <= len(need.bitmap) <= MAX_BITMAP:
        raise ValueError(f"{need} does not fit its record")
    return _NEED.pack(need.node, need.number) + need.bitmap


def parse_need(value: bytes) -> Need:
    """The fields of a NEED value of sufficient length; what follows 16 octets is ignored."""
    node, number = _NEED.unpack_from(value)
    return Need(node, number, bytes(value[_NEED.size : _NEED.size + MAX_BITMAP]))


def build_bare(told: Bare) -> bytes:
    """The value of a BARE record. Raises ValueError if a field is out of range."""
    if not 1 <= len(told.bitmap) <= MAX_BITMAP:
        raise ValueError(f"{told} does not fit its record")
    return bytes((told.seq,)) + told.bitmap


def parse_bare(value: bytes) -> Bare:
    """The fields of a BARE value of sufficient length; what follows 16 octets is ignored."""
    return Bare(value[0], bytes(value[1 : 1 + MAX_BITMAP]))


def build_repeat(repeat: Repeat) -> bytes:
    """The value of a REPEAT record. Raises struct.error if a field is out of range."""
    return _REPEAT.pack(*repeat)


def parse_repeat(value: bytes) -> Repeat:
    """The fields of a REPEAT value of sufficient length."""
    return Repeat(*_REPEAT.unpack_from(value))
