"""Adjusts a PDU that leaves later than planned: postponed, or forwarded by a relay."""

import struct
from collections.abc import Iterator
from contextlib import suppress

from sdrlinkd.errors import PduError
from sdrlinkd.wire.builder import HEADER
from sdrlinkd.wire.capacity import CRC_SIZE, ENTRY_HEADER_SIZE, HEADER_SIZE
from sdrlinkd.wire.control import (
    MAX_AGE_US,
    MAX_SINCE,
    RECEIPT_UNIT_US,
    record_spans,
)
from sdrlinkd.wire.crc import crc16
from sdrlinkd.wire.pdu import identity
from sdrlinkd.wire.record_types import RecordType
from sdrlinkd.wire.registry import CONTROL_TOPIC_ID
from sdrlinkd.wire.repeat import HELD_AT

# Offset in a record's value of the time that counts up to the burst's preamble.
_AGE, _PHASE = 2, 4
_POSTPONED = {int(RecordType.STAMP): _AGE, int(RecordType.FRAME): _PHASE}
# A relay does not adjust FRAME: each robot announces the schedule itself.
_FORWARDED = {int(RecordType.STAMP): _AGE}
_STARTS = {int(RecordType.FRAME), int(RecordType.CLOCK)}
_U32 = struct.Struct(">I")
_U16 = struct.Struct(">H")
# Times in smaller fields, in units of 0.1 ms. That of a RECEIPT may be absent.
_SINCE, _SHORT_UNIT_US = 6, RECEIPT_UNIT_US
_SHORT_POSTPONED = {int(RecordType.RECEIPT): _SINCE, int(RecordType.REPEAT): HELD_AT}
SRC, DST, SEQ, HOP = 1, 2, 3, 4
"""Indexes of the octets with source, destination and sequence number, and of that with the hops
left and the number of entries."""


def postponed(pdu: bytes, by_us: int) -> bytes:
    """A PDU of our own, with control channel, adjusted for a burst that leaves `by_us` µs later."""
    data = bytearray(pdu)
    _move(data, by_us, _POSTPONED)
    _move_short(data, by_us, _SHORT_POSTPONED)
    return _with_crc(data)


def aged(pdu: bytes, by_us: int, *, only_ages: bool = False) -> bytes:
    """A PDU, or an inner PDU, whose times grow by the `by_us` µs for which it was delayed.

    `only_ages`: those in RECEIPT and REPEAT stay.
    """
    data = bytearray(pdu)
    _move(data, by_us, _FORWARDED)
    if not only_ages:
        _move_short(data, by_us, _SHORT_POSTPONED)
    return _with_crc(data)


def with_seq(pdu: bytes, seq: int) -> bytes:
    """A PDU with another sequence number."""
    data = bytearray(pdu)
    data[SEQ] = seq
    return _with_crc(data)


def depends_on_start(pdu: bytes) -> bool:
    """Whether a PDU with control channel holds a record whose content fits one start alone."""
    return any(kind in _STARTS for kind, _, _ in _records(pdu))


def forwarded(pdu: bytes, by_us: int, has_control: bool) -> bytes:
    """A valid PDU of another node with one hop less, sent `by_us` µs after the burst it came in.

    Raises ValueError if it has no hop left.
    """
    data = bytearray(pdu)
    if data[HOP] >> 4 < 2:
        raise ValueError(f"a PDU with {data[HOP] >> 4} hops left is not forwarded")
    data[HOP] -= 1 << 4
    if has_control:
        _move(data, by_us, _FORWARDED)
    return _with_crc(data)


def lasting_identity(pdu: bytes) -> tuple[int, int, int]:
    """`identity` of a valid PDU with control channel, with the ages in its STAMPs taken as zero.

    A relay adds the time for which it held the PDU to those ages.
    """
    ages = [*_times(pdu, _FORWARDED)]
    if not ages:
        return identity(pdu)
    without = bytearray(pdu)
    for at in ages:
        _U32.pack_into(without, at, 0)
    return identity(without)


def _times(pdu: bytes | bytearray, kinds: dict[int, int]) -> Iterator[int]:
    """Indices in a valid PDU of the times in records of `kinds`."""
    for kind, at, _ in _records(pdu):
        offset = kinds.get(kind)
        if offset is not None:
            yield at + offset


def _records(pdu: bytes | bytearray) -> Iterator[tuple[int, int, int]]:
    """(type, start of the value, its length) of all records in a valid PDU.

    Unreadable control entries are skipped.
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


def _move_short(data: bytearray, by_us: int, kinds: dict[int, int]) -> None:
    for kind, at, length in _records(data):
        offset = kinds.get(kind)
        if offset is not None and length >= offset + _U16.size:
            (told,) = _U16.unpack_from(data, at + offset)
            later = told + by_us // _SHORT_UNIT_US
            _U16.pack_into(data, at + offset, min(later, MAX_SINCE))


def _with_crc(data: bytearray) -> bytes:
    data[-CRC_SIZE:] = crc16(data[:-CRC_SIZE]).to_bytes(CRC_SIZE, "big")
    return bytes(data)
