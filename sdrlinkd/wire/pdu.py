"""A PDU as bytes and as fields (wire document, sections 3 to 5)."""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple
from zlib import crc32

from sdrlinkd.errors import PduError
from sdrlinkd.wire.builder import (
    ENTRY_HEADER,
    FLAG_COMPRESSED,
    FLAG_SEALED,
    HEADER,
    VERSION,
    PduBuilder,
)
from sdrlinkd.wire.capacity import CRC_SIZE, ENTRY_HEADER_SIZE, HEADER_SIZE
from sdrlinkd.wire.crc import crc16


class Entry(NamedTuple):
    """One entry of a PDU: fragment `index` of `total` of message (topic id, entry id)."""

    topic_id: int
    entry_id: int
    index: int  # type: ignore[assignment]  # the format's own word
    total: int
    payload: bytes


class Pdu(NamedTuple):
    """The fields of a PDU; `qos` is the two-bit Q field, `hop` the hops left."""

    qos: int
    compressed: bool
    src: int
    dst: int
    seq: int
    hop: int
    entries: Sequence[Entry]


def build(pdu: Pdu, pdu_size: int) -> bytes:
    """The PDU as exactly `pdu_size` bytes.

    Raises ValueError if a field is out of range or the entries do not fit, a bug of the sender.
    """
    if not 0 <= pdu.qos <= 3:
        raise ValueError(f"qos is {pdu.qos}, allowed 0 to 3")
    builder = PduBuilder(pdu_size)
    for entry in pdu.entries:
        builder.add(*entry)
    return builder.build(flags(pdu.qos, pdu.compressed), pdu.src, pdu.dst, pdu.seq, pdu.hop)


def flags(qos: int, compressed: bool = False) -> int:
    """The first octet of a PDU of this version, with its class and compression flag."""
    return VERSION << 4 | qos << 2 | (FLAG_COMPRESSED if compressed else 0)


def parse(data: bytes, pdu_size: int, *, is_intact: bool = False) -> Pdu:
    """The fields of the PDU in `data`; only the canonical form of a PDU is accepted.

    The CRC of a PDU that is known to be intact is not checked.

    Raises PduError with reason rx_short (not `pdu_size` bytes), rx_crc, rx_version, rx_flags
    (sealed, which we do not speak), rx_entry or rx_pad.
    """
    if len(data) != pdu_size:
        raise PduError("rx_short", f"{len(data)} bytes where a PDU has {pdu_size}")
    end = pdu_size - CRC_SIZE
    # Without a final xor, the CRC over data and its own CRC is zero.
    if not is_intact and crc16(data):
        raise PduError("rx_crc", "CRC-16 does not match")
    first, src, dst, seq, hop_count = HEADER.unpack_from(data)
    if first >> 4 != VERSION:
        raise PduError("rx_version", f"version {first >> 4}, this is version {VERSION}")
    if first & FLAG_SEALED:
        raise PduError("rx_flags", "sealed (E=1)")
    n = hop_count & 0x0F
    if n == 0:
        raise PduError("rx_entry", "no entries")
    at = HEADER_SIZE + (n + 1) // 2
    entries = []
    for i in range(n):
        nibbles = data[HEADER_SIZE + i // 2]
        if at + ENTRY_HEADER_SIZE > end:
            raise PduError("rx_entry", f"entry {i} begins past the end")
        entry_id, index, total, length = ENTRY_HEADER.unpack_from(data, at)
        at += ENTRY_HEADER_SIZE
        if at + length > end:
            raise PduError("rx_entry", f"entry {i} of {length} bytes overruns the PDU")
        if index >= total:
            raise PduError("rx_entry", f"entry {i} is number {index} of {total}")
        topic_id = nibbles & 0x0F if i & 1 else nibbles >> 4
        entries.append(Entry(topic_id, entry_id, index, total, data[at : at + length]))
        at += length
    if n & 1 and data[HEADER_SIZE + n // 2] & 0x0F:
        raise PduError("rx_entry", "the unused topic id nibble is not zero")
    if data.count(0, at, end) != end - at:
        raise PduError("rx_pad", "PAD is not zero")
    return Pdu(
        (first >> 2) & 3, bool(first & FLAG_COMPRESSED), src, dst, seq, hop_count >> 4, entries
    )


def identity(data: bytes | bytearray) -> tuple[int, int, int]:
    """(src, seq, CRC-32 with the hop nibble taken as zero), equal for all receptions of one PDU.

    A relay changes the hop nibble and with it the PDU's own CRC. CRC-32 is linear, so one table
    look-up removes the nibble's contribution. The PDU's own CRC would not do: several PDUs with the
    same seq come in a second, and each would be taken for another once in 65536 times.
    """
    crc = crc32(memoryview(data)[:-CRC_SIZE])
    return data[1], data[3], crc ^ _hop_shares(len(data))[data[4] >> 4]


def source_and_class(data: bytes) -> tuple[int, int]:
    """(src, Q field) of an intact PDU, sealed or not."""
    return data[1], (data[0] >> 2) & 3


@lru_cache(maxsize=8)
def _hop_shares(pdu_size: int) -> tuple[int, ...]:
    """What the values of the hop nibble contribute to the CRC-32."""
    rest = bytes(pdu_size - HEADER_SIZE - CRC_SIZE)
    crcs = [crc32(bytes((0, 0, 0, 0, hop << 4)) + rest) for hop in range(16)]
    return tuple(crc ^ crcs[0] for crc in crcs)
