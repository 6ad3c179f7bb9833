"""A PDU that leaves later than it was made for: postponed, or forwarded by a relay."""

import struct
from binascii import crc_hqx
from collections.abc import Iterator
from contextlib import suppress

from sdrlinkd.errors import PduError
from sdrlinkd.wire.builder import HEADER
from sdrlinkd.wire.capacity import CRC_SIZE, ENTRY_HEADER_SIZE, HEADER_SIZE
from sdrlinkd.wire.control import (
    MAX_AGE_US,
    MAX_SINCE,
    RECEIPT_UNIT_US,
    RecordType,
    record_spans,
)
from sdrlinkd.wire.pdu import identity
from sdrlinkd.wire.registry import CONTROL_TOPIC_ID

# Where in a record's value the time stands that counts up to the burst's preamble.
_AGE, _PHASE = 2, 4
_POSTPONED = {int(RecordType.STAMP): _AGE, int(RecordType.FRAME): _PHASE}
# The schedule is told by those who keep it.
_FORWARDED = {int(RecordType.STAMP): _AGE}
_U32 = struct.Struct(">I")
# RECEIPT counts up in a smaller field, and not always.
_SINCE, _SINCE_END = 6, 8
_U16 = struct.Struct(">H")
HOP = 4
"""Octet of hops left and number of entries."""


def postponed(pdu: bytes, by_us: int) -> bytes:
    """A PDU of our own, with control channel, as it is when its burst leaves `by_us` µs later."""
    data = bytearray(pdu)
    _move(data, by_us, _POSTPONED)
    for kind, at, length in _records(data):
        if kind == RecordType.RECEIPT and length >= _SINCE_END:
            (since,) = _U16.unpack_from(data, at + _SINCE)
            _U16.pack_into(data, at + _SINCE, min(since + by_us // RECEIPT_UNIT_US, MAX_SINCE))
    return _sealed(data)


def forwarded(pdu: bytes, by_us: int, has_control: bool) -> bytes:
    """A good PDU of another node with a hop less, in a burst `by_us` µs after the one it came in.

    Raises ValueError when it has no hop to spare.
    """
    data = bytearray(pdu)
    if data[HOP] >> 4 < 2:
        raise ValueError(f"a PDU with {data[HOP] >> 4} hops left is not forwarded")
    data[HOP] -= 1 << 4
    if has_control:
        _move(data, by_us, _FORWARDED)
    return _sealed(data)


def lasting_identity(pdu: bytes) -> tuple[int, int, int]:
    """`identity` of a good PDU with control channel, ages in its STAMPs taken as zero.

    A relay adds to those ages what it held the PDU for. CRC-16 is linear: the share of four octets
    is that of the same in a body of zeros.
    """
    src, seq, crc = identity(pdu)
    end = len(pdu) - CRC_SIZE
    for at in _times(pdu, _FORWARDED):
        crc ^= crc_hqx(pdu[at : at + _U32.size] + bytes(end - at - _U32.size), 0)
    return src, seq, crc


def _times(pdu: bytes | bytearray, kinds: dict[int, int]) -> Iterator[int]:
    """Where in a good PDU the times of records of `kinds` stand."""
    for kind, at, _ in _records(pdu):
        offset = kinds.get(kind)
        if offset is not None:
            yield at + offset


def _records(pdu: bytes | bytearray) -> Iterator[tuple[int, int, int]]:
    """(type, where the value begins, its length) of all records in a good PDU.

    Control entries that cannot be read have none.
    """
    n_entries = HEADER.unpack_from(pdu)[HOP] & 0x0F
    at = HEADER_SIZE + (n_entries + 1) // 2
    for i in range(n_entries):
        pair = pdu[HEADER_SIZE + i // 2]
        topic_id = pair >> 4 if i % 2 == 0 else pair & 0x0F
        begin, total = at + ENTRY_HEADER_SIZE, pdu[at + 2]
        at = begin + (pdu[at + 3] << 8 | pdu[at + 4])
        if topic_id == CONTROL_TOPIC_ID and total == 1:
            with suppress(PduError):
                yield from record_spans(pdu, begin, at)


def _move(data: bytearray, by_us: int, kinds: dict[int, int]) -> None:
    for at in _times(data, kinds):
        (told,) = _U32.unpack_from(data, at)
        _U32.pack_into(data, at, min(told + by_us, MAX_AGE_US))


def _sealed(data: bytearray) -> bytes:
    data[-CRC_SIZE:] = crc_hqx(data[:-CRC_SIZE], 0).to_bytes(CRC_SIZE, "big")
    return bytes(data)
