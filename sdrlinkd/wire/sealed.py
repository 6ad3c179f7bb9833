"""The layout of a sealed PDU (wire document, section 11); the cipher is elsewhere."""

import struct
from binascii import crc_hqx
from typing import NamedTuple

from sdrlinkd.errors import PduError
from sdrlinkd.wire.builder import FLAG_SEALED, HEADER, VERSION
from sdrlinkd.wire.capacity import CRC_SIZE, HEADER_SIZE, MIN_PDU_SIZE
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
_HELD_AT = HEADER_SIZE + _NUMBER.size
_BODY_AT = _HELD_AT + _HELD.size
_NO_HELD = bytes(_HELD.size)


class Sealed(NamedTuple):
    """The fields of a sealed PDU; `held` is in units of 0.1 ms, `ticks` is T in 1/32 s."""

    header: bytes
    kid: int
    ticks: int
    held: int
    body: bytes
    tag: bytes

    @property
    def src(self) -> int:
        """Id of the source robot."""
        return self.header[1]

    @property
    def dst(self) -> int:
        """Id of the destination robot; 255: everyone."""
        return self.header[2]

    @property
    def seq(self) -> int:
        """Sequence number of the source, modulo 256."""
        return self.header[3]

    @property
    def held_s(self) -> float:
        """Time in s for which the PDU was delayed on its way."""
        return self.held * HELD_UNIT_S

    @property
    def nonce(self) -> bytes:
        """The nonce of the cipher, 13 octets."""
        return seal_nonce(self.kid, self.ticks, self.seq)

    @property
    def associated(self) -> bytes:
        """The associated data: all octets before the body that stay the same on the way."""
        return associated_data(self.header, self.kid, self.ticks)

    def inner(self, plaintext: bytes) -> bytes:
        """The inner PDU, from its plaintext."""
        head = bytes((self.header[0] & ~FLAG_SEALED,)) + self.header[1:]
        return _with_crc(head + plaintext)


def is_sealed(data: bytes) -> bool:
    """Whether a PDU's first octet says that it is sealed."""
    return bool(data) and bool(data[0] & FLAG_SEALED)


def plaintext(inner: bytes) -> bytes:
    """What is sealed of an inner PDU."""
    return inner[HEADER_SIZE:-CRC_SIZE]


def sealed_header(inner: bytes) -> bytes:
    """The header of a sealed PDU with this inner PDU."""
    return bytes((inner[0] | FLAG_SEALED,)) + inner[1:HEADER_SIZE]


def seal_nonce(kid: int, ticks: int, seq: int) -> bytes:
    """The nonce under which a PDU is sealed, 13 octets; never used twice with one key."""
    return bytes(8) + _NUMBER.pack(kid << 30 | ticks) + bytes((seq,))


def associated_data(header: bytes, kid: int, ticks: int) -> bytes:
    """What is authenticated besides the body: header without hop, kid, T, and a `held` of zero."""
    lasting = header[:HOP] + bytes((header[HOP] & 0x0F,))
    return lasting + _NUMBER.pack(kid << 30 | ticks) + _NO_HELD


def build_sealed(header: bytes, kid: int, ticks: int, body_and_tag: bytes) -> bytes:
    """The octets of a sealed PDU that was not delayed yet."""
    return _with_crc(header + _NUMBER.pack(kid << 30 | ticks) + _NO_HELD + body_and_tag)


def parse_sealed(data: bytes, pdu_size: int) -> Sealed:
    """The fields of a sealed PDU.

    Raises PduError with reason rx_short (not `pdu_size` octets), rx_crc, rx_version or rx_entry (no
    entries).
    """
    if len(data) != pdu_size or pdu_size < MIN_SEALED_SIZE:
        raise PduError("rx_short", f"{len(data)} bytes where a PDU has {pdu_size}")
    if crc_hqx(data, 0):
        raise PduError("rx_crc", "CRC-16 does not match")
    if data[0] >> 4 != VERSION:
        raise PduError("rx_version", f"version {data[0] >> 4}, this is version {VERSION}")
    if not data[HOP] & 0x0F:
        raise PduError("rx_entry", "no entries")
    (number,) = _NUMBER.unpack_from(data, HEADER_SIZE)
    (held,) = _HELD.unpack_from(data, _HELD_AT)
    end = pdu_size - CRC_SIZE
    return Sealed(
        data[: HEADER.size],
        number >> 30,
        number & (N_TICKS - 1),
        held,
        data[_BODY_AT : end - TAG_SIZE],
        data[end - TAG_SIZE : end],
    )


def delayed(data: bytes, by_us: int, hops: int = 0) -> bytes:
    """A sealed PDU that leaves `by_us` µs later, after `hops` more relays.

    Raises ValueError if it has too few hops left.
    """
    changed = bytearray(data)
    if hops:
        if changed[HOP] >> 4 <= hops:
            raise ValueError(f"a PDU with {changed[HOP] >> 4} hops left is not forwarded")
        changed[HOP] -= hops << 4
    (held,) = _HELD.unpack_from(changed, _HELD_AT)
    # Rounded up, so that many short delays do not vanish.
    later = held - (-max(by_us, 0) // round(1e6 * HELD_UNIT_S))
    _HELD.pack_into(changed, _HELD_AT, min(later, MAX_HELD))
    return _with_crc(bytes(changed[:-CRC_SIZE]))


def leaves_later(pdu: bytes, by_us: int) -> bytes:
    """A PDU of our own, with control channel, for a burst that leaves `by_us` µs later."""
    return delayed(pdu, by_us) if is_sealed(pdu) else postponed(pdu, by_us)


def _with_crc(body: bytes) -> bytes:
    return body + crc_hqx(body, 0).to_bytes(CRC_SIZE, "big")
