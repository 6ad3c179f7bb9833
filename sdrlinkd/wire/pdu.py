"""A PDU as bytes and as fields (wire document, sections 3 to 5)."""

import binascii
import struct
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

from sdrlinkd.errors import PduError
from sdrlinkd.wire.capacity import CRC_SIZE, ENTRY_HEADER_SIZE, HEADER_SIZE, MAX_ENTRIES

VERSION = 0
BROADCAST = 0xFF

_HEADER = struct.Struct(">BBBBB")
_ENTRY = struct.Struct(">BBBH")
_SINGLE = struct.Struct(">BBBBBBBBBH")

_FLAG_COMPRESSED = 0x02
_FLAG_SEALED = 0x01


class Entry(NamedTuple):
    """One fragment of a message: entry `index` of `total` under (topic id, entry id)."""

    topic_id: int
    entry_id: int
    index: int
    total: int
    payload: bytes


class Pdu(NamedTuple):
    """The fields of a PDU. `qos` is the two-bit Q field, `hop` the hops left."""

    qos: int
    compressed: bool
    src: int
    dst: int
    seq: int
    hop: int
    entries: Sequence[Entry]


def build(pdu: Pdu, pdu_size: int) -> bytes:
    """Exactly `pdu_size` bytes for `pdu`.

    Raises ValueError when a field is out of range or the entries do not fit: the sender's bug.
    """
    entries = pdu.entries
    n = len(entries)
    if not 1 <= n <= MAX_ENTRIES:
        raise ValueError(f"a PDU holds 1 to {MAX_ENTRIES} entries, not {n}")
    flags = VERSION << 4 | _check("qos", pdu.qos, 3) << 2
    if pdu.compressed:
        flags |= _FLAG_COMPRESSED
    hop_count = _check("hop", pdu.hop, 15) << 4 | n
    try:
        if n == 1:
            topic_id, entry_id, index, total, payload = entries[0]
            tid = _check("topic id", topic_id, 15) << 4
            _check_index(index, total)
            head = _SINGLE.pack(
                flags, pdu.src, pdu.dst, pdu.seq, hop_count, tid,
                entry_id, index, total, len(payload),
            )  # fmt: skip
            parts = [head, payload]
        else:
            parts = [
                _HEADER.pack(flags, pdu.src, pdu.dst, pdu.seq, hop_count),
                _pack_topic_ids([entry.topic_id for entry in entries]),
            ]
            for _, entry_id, index, total, payload in entries:
                _check_index(index, total)
                parts += (_ENTRY.pack(entry_id, index, total, len(payload)), payload)
    except struct.error as error:
        raise ValueError(f"a field does not fit its octets: {error}") from None
    body = b"".join(parts).ljust(pdu_size - CRC_SIZE, b"\0")
    if len(body) != pdu_size - CRC_SIZE:
        raise ValueError(f"{n} entries overrun a PDU of {pdu_size} bytes")
    return body + binascii.crc_hqx(body, 0).to_bytes(2, "big")


def parse(data: bytes, pdu_size: int) -> Pdu:
    """The fields of the PDU in `data`; only the canonical form of a PDU is accepted.

    Raises PduError with reason rx_short (not `pdu_size` bytes), rx_crc, rx_version, rx_flags
    (sealed or compressed-reserved bits we do not speak), rx_entry or rx_pad.
    """
    if len(data) != pdu_size:
        raise PduError("rx_short", f"{len(data)} bytes where a PDU has {pdu_size}")
    end = pdu_size - CRC_SIZE
    # A CRC with no final xor over data and its own CRC leaves zero.
    if binascii.crc_hqx(data, 0):
        raise PduError("rx_crc", "CRC-16 does not match")
    flags, src, dst, seq, hop_count = _HEADER.unpack_from(data)
    if flags >> 4 != VERSION:
        raise PduError("rx_version", f"version {flags >> 4}, this is version {VERSION}")
    if flags & _FLAG_SEALED:
        raise PduError("rx_flags", "sealed PDU (E=1) and no key")
    n = hop_count & 0x0F
    if n == 0:
        raise PduError("rx_entry", "no entries")
    at = HEADER_SIZE + (n + 1) // 2
    entries = []
    for i in range(n):
        nibbles = data[HEADER_SIZE + i // 2]
        if at + ENTRY_HEADER_SIZE > end:
            raise PduError("rx_entry", f"entry {i} begins past the end")
        entry_id, index, total, length = _ENTRY.unpack_from(data, at)
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
    return Pdu((flags >> 2) & 3, bool(flags & _FLAG_COMPRESSED), src, dst, seq, hop_count >> 4, entries)


def identity(data: bytes) -> tuple[int, int, int]:
    """(src, seq, CRC with the hop nibble taken as zero): what makes two receptions one PDU.

    A relay changes the hop nibble and with it the CRC. CRC-16 is linear, so the share of the
    nibble is taken out again with one look-up instead of a second pass over the PDU.
    """
    crc = data[-2] << 8 | data[-1]
    return data[1], data[3], crc ^ _hop_shares(len(data))[data[4] >> 4]


@lru_cache(maxsize=8)
def _hop_shares(pdu_size: int) -> tuple[int, ...]:
    """CRC of a body that is zero but for each of the 16 hop nibbles."""
    rest = bytes(pdu_size - HEADER_SIZE - CRC_SIZE)
    return tuple(binascii.crc_hqx(bytes((0, 0, 0, 0, hop << 4)) + rest, 0) for hop in range(16))


def _pack_topic_ids(topic_ids: list[int]) -> bytes:
    padded = [*topic_ids, 0]
    for topic_id in topic_ids:
        _check("topic id", topic_id, 15)
    return bytes(padded[i] << 4 | padded[i + 1] for i in range(0, len(topic_ids), 2))


def _check(name: str, value: int, most: int) -> int:
    if not 0 <= value <= most:
        raise ValueError(f"{name} is {value}, allowed 0 to {most}")
    return value


def _check_index(index: int, total: int) -> None:
    if index >= total:
        raise ValueError(f"entry index {index} of total {total}")
