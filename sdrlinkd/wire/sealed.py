"""The layout of a sealed PDU (wire document, section 11); the cipher is elsewhere."""

import struct
from collections.abc import Callable
from typing import NamedTuple

from sdrlinkd.errors import PduError
from sdrlinkd.wire.builder import FLAG_SEALED, VERSION
from sdrlinkd.wire.capacity import CRC_SIZE, HEADER_SIZE, MIN_PDU_SIZE
from sdrlinkd.wire.crc import crc16
from sdrlinkd.wire.later import HOP, forwarded, postponed

TAG_SIZE = 8
SEAL_OVERHEAD = 14
"""Octets of a sealed PDU besides those of the inner PDU."""
MIN_SEALED_SIZE = MIN_PDU_SIZE + SEAL_OVERHEAD
N_KIDS = 4
TICKS_PER_S = 32
"""Units of T in a second."""
N_SEQS = 256
"""Values of seq."""
N_TICKS = 1 << 30
"""Values of T; at the end of them, a key is used up."""
HELD_UNIT_S = 1e-4
MAX_HELD = 0xFFFF
_HELD = struct.Struct(">H")
_CRC = struct.Struct(">H")
_BEGIN = struct.Struct(">BBBBB")
_HEAD = struct.Struct(">BBBBBIH")
_NONCE = struct.Struct(">8xIB")
_KID_AT = 30
"""Bit from which on the kid stands in a number."""
_NUMBER_END = HEADER_SIZE + 4
_BODY_AT = _HEAD.size
_SECRET_END = -CRC_SIZE
_COUNT = 0x0F
"""The bits of the hop octet that stay the same on the way."""
_NO_CRC = bytes(CRC_SIZE)
_make = tuple.__new__
"""Makes a named tuple in half the time that its own constructor takes."""

Cipher = Callable[[bytes, bytes, bytes], bytes]
"""(nonce, text, associated data) → the text, encrypted or decrypted.

The nonce has seq and the time T; the associated data are what stays the same on the way of the
octets before the body.
"""


class Sealed(NamedTuple):
    """The fields of a sealed PDU; `held` is in units of 0.1 ms, `ticks` is T in 1/32 s.

    `data` is the whole PDU, `first` its first octet, and `hop` the fifth one.
    """

    data: bytes
    first: int
    src: int
    dst: int
    seq: int
    hop: int
    kid: int
    ticks: int
    held: int

    def inner(self, decrypt: Cipher) -> bytes:
        """The inner PDU; its CRC, which the tag makes needless, is left out.

        `decrypt` is given body and tag, and raises what it likes.
        """
        data, first, src, dst, seq, hop, kid, ticks, _ = self
        number = kid << _KID_AT | ticks
        associated = _HEAD.pack(first, src, dst, seq, hop & _COUNT, number, 0)
        text = decrypt(_NONCE.pack(number, seq), data[_BODY_AT:_SECRET_END], associated)
        return _BEGIN.pack(first & ~FLAG_SEALED, src, dst, seq, hop) + text + _NO_CRC


def is_sealed(data: bytes) -> bool:
    """Whether a PDU's first octet says that it is sealed."""
    return bool(data) and bool(data[0] & FLAG_SEALED)


def build_sealed(inner: bytes, kid: int, ticks: int, encrypt: Cipher) -> bytes:
    """The sealed PDU of an inner one; `encrypt` returns body and tag.

    No seq may be used twice with one T and one key.
    """
    first, src, dst, seq, hop = _BEGIN.unpack_from(inner)
    number = kid << _KID_AT | ticks
    first |= FLAG_SEALED
    associated = _HEAD.pack(first, src, dst, seq, hop & _COUNT, number, 0)
    secret = encrypt(_NONCE.pack(number, seq), inner[HEADER_SIZE:_SECRET_END], associated)
    body = _HEAD.pack(first, src, dst, seq, hop, number, 0) + secret
    return body + _CRC.pack(crc16(body))


def parse_sealed(data: bytes, pdu_size: int) -> Sealed:
    """The fields of a sealed PDU.

    Raises PduError with reason rx_short (not `pdu_size` octets), rx_crc, rx_version or rx_entry (no
    entries).
    """
    if len(data) != pdu_size or pdu_size < MIN_SEALED_SIZE:
        raise PduError("rx_short", f"{len(data)} bytes where a PDU has {pdu_size}")
    if crc16(data):
        raise PduError("rx_crc", "CRC-16 does not match")
    first, src, dst, seq, hop, number, held = _HEAD.unpack_from(data)
    if first >> 4 != VERSION:
        raise PduError("rx_version", f"version {first >> 4}, this is version {VERSION}")
    if not hop & _COUNT:
        raise PduError("rx_entry", "no entries")
    kid, ticks = number >> _KID_AT, number & (N_TICKS - 1)
    return _make(Sealed, (data, first, src, dst, seq, hop, kid, ticks, held))


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
    body = bytes(changed[:-CRC_SIZE])
    return body + _CRC.pack(crc16(body))


def relayed(pdu: bytes, by_us: int, has_control: bool) -> bytes:
    """Another robot's PDU with one hop less, which leaves `by_us` µs after the burst it came in.

    Raises ValueError if it has no hop left.
    """
    return delayed(pdu, by_us, hops=1) if is_sealed(pdu) else forwarded(pdu, by_us, has_control)


def leaves_later(pdu: bytes, by_us: int) -> bytes:
    """A PDU of our own, with control channel, for a burst that leaves `by_us` µs later."""
    return delayed(pdu, by_us) if is_sealed(pdu) else postponed(pdu, by_us)
