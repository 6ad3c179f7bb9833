"""The layout of a sealed PDU (wire document, section 11); the cipher is elsewhere."""

import struct
from typing import NamedTuple

from sdrlinkd.errors import PduError
from sdrlinkd.wire.builder import FLAG_SEALED, VERSION
from sdrlinkd.wire.capacity import CRC_SIZE, HEADER_SIZE, MIN_PDU_SIZE
from sdrlinkd.wire.crc import crc16
from sdrlinkd.wire.later import HOP, postponed

TAG_SIZE = 8
SEAL_OVERHEAD = 14
"""Octets of a sealed PDU besides those of the inner PDU."""
MIN_SEALED_SIZE = MIN_PDU_SIZE + SEAL_OVERHEAD
N_KIDS = 4
TICKS_PER_S = 32
"""Units of T in a second."""
N_TICKS = 1 << 30
"""Values of T; at the end of them, a key is used up."""
HELD_UNIT_S = 1e-4
MAX_HELD = 0xFFFF
_NUMBER = struct.Struct(">I")
_HELD = struct.Struct(">H")
_HEAD = struct.Struct(">BBBBBIH")
_NUMBER_END = HEADER_SIZE + _NUMBER.size
_BODY_AT = _HEAD.size
_SECRET_END = -CRC_SIZE
_NO_HELD = bytes(_HELD.size)
_NONCE_BEGIN = bytes(8)
_OCTETS = tuple(bytes((value,)) for value in range(256))
_LOW = tuple(bytes((value & 0x0F,)) for value in range(256))
"""An octet with its high nibble taken as zero, by its value."""
_CLEAR = tuple(bytes((value & ~FLAG_SEALED,)) for value in range(256))
_NO_CRC = bytes(CRC_SIZE)
_make = tuple.__new__
"""Makes a named tuple in half the time that its own constructor takes."""


class Sealed(NamedTuple):
    """The fields of a sealed PDU; `held` is in units of 0.1 ms, `ticks` is T in 1/32 s.

    `data` is the whole PDU.
    """

    data: bytes
    src: int
    dst: int
    seq: int
    kid: int
    ticks: int
    held: int

    def parts(self) -> tuple[bytes, bytes, bytes]:
        """(nonce, associated data, body and tag).

        The associated data are the octets before the body that stay the same on the way.
        """
        data = self.data
        number = data[HEADER_SIZE:_NUMBER_END]
        return (
            _NONCE_BEGIN + number + data[3:4],
            data[:HOP] + _LOW[data[HOP]] + number + _NO_HELD,
            data[_BODY_AT:_SECRET_END],
        )

    def inner(self, plaintext: bytes) -> bytes:
        """The inner PDU, from its plaintext; its CRC, which the tag makes needless, is left out."""
        data = self.data
        return _CLEAR[data[0]] + data[1:HEADER_SIZE] + plaintext + _NO_CRC


def is_sealed(data: bytes) -> bool:
    """Whether a PDU's first octet says that it is sealed."""
    return bool(data) and bool(data[0] & FLAG_SEALED)


def seal_parts(inner: bytes, number: bytes) -> tuple[bytes, bytes, bytes, bytes]:
    """(octets before the body, nonce, associated data, plaintext) of an inner PDU, to be sealed.

    `number` is that of `seal_number`. A nonce must never be used twice.
    """
    begin = _OCTETS[inner[0] | FLAG_SEALED] + inner[1:HOP]
    hop = inner[HOP]
    return (
        begin + _OCTETS[hop] + number + _NO_HELD,
        _NONCE_BEGIN + number + inner[3:4],
        begin + _LOW[hop] + number + _NO_HELD,
        inner[HEADER_SIZE:-CRC_SIZE],
    )


def seal_number(kid: int, ticks: int) -> bytes:
    """The octets of kid and T."""
    return _NUMBER.pack(kid << 30 | ticks)


def build_sealed(head: bytes, secret: bytes) -> bytes:
    """The octets of a sealed PDU, from those before the body, and from body and tag."""
    body = head + secret
    return body + crc16(body).to_bytes(CRC_SIZE, "big")


def parse_sealed(data: bytes, pdu_size: int) -> Sealed:
    """The fields of a sealed PDU.

    Raises PduError with reason rx_short (not `pdu_size` octets), rx_crc, rx_version or rx_entry (no
    entries).
    """
    if len(data) != pdu_size or pdu_size < MIN_SEALED_SIZE:
        raise PduError("rx_short", f"{len(data)} bytes where a PDU has {pdu_size}")
    if crc16(data):
        raise PduError("rx_crc", "CRC-16 does not match")
    first, src, dst, seq, hop_count, number, held = _HEAD.unpack_from(data)
    if first >> 4 != VERSION:
        raise PduError("rx_version", f"version {first >> 4}, this is version {VERSION}")
    if not hop_count & 0x0F:
        raise PduError("rx_entry", "no entries")
    fields = (data, src, dst, seq, number >> 30, number & (N_TICKS - 1), held)
    return _make(Sealed, fields)


def delayed(data: bytes, by_us: int, hops: int = 0) -> bytes:
    """A sealed PDU that leaves `by_us` µs later, after `hops` more relays.

    Raises ValueError if it has too few hops left.
    """
    changed = bytearray(data)
    if hops:
        if changed[HOP] >> 4 <= hops:
            raise ValueError(f"a PDU with {changed[HOP] >> 4} hops left is not forwarded")
        changed[HOP] -= hops << 4
    (held,) = _HELD.unpack_from(changed, _NUMBER_END)
    # Rounded up, so that many short delays do not vanish.
    later = held - (-max(by_us, 0) // round(1e6 * HELD_UNIT_S))
    _HELD.pack_into(changed, _NUMBER_END, min(later, MAX_HELD))
    return _with_crc(bytes(changed[:-CRC_SIZE]))


def leaves_later(pdu: bytes, by_us: int) -> bytes:
    """A PDU of our own, with control channel, for a burst that leaves `by_us` µs later."""
    return delayed(pdu, by_us) if is_sealed(pdu) else postponed(pdu, by_us)


def _with_crc(body: bytes) -> bytes:
    return body + crc16(body).to_bytes(CRC_SIZE, "big")
