"""Control records: TLVs in entries of topic id 0xF (wire document, section 6)."""

import struct
from collections.abc import Iterable
from enum import IntEnum
from typing import NamedTuple

from sdrlinkd.errors import PduError
from sdrlinkd.wire.clock import Clock, build_clock, parse_clock
from sdrlinkd.wire.registry import BROADCAST, RegistryDigest

TLV_HEADER_SIZE = 2
MAX_AGE_US = 0xFFFFFFFF
MAX_VALUE_SIZE = 255
NO_AGE = 0xFFFF
RECEIPT_UNIT_US = 100
RECEIPT_UNIT_S = RECEIPT_UNIT_US / 1e6
MAX_SINCE = 0xFFFF
"""Of a RECEIPT's times, in that unit."""


class RecordType(IntEnum):
    """First octet of a record. Numbers are never reused."""

    STAMP = 1
    BEACON = 2
    DIGEST = 3
    LINK_REPORT = 4
    RECEIPT = 5
    PARITY = 6
    FRAME = 7
    CLOCK = 8
    WAITS = 9


class Stamp(NamedTuple):
    """Age of a message at this burst's preamble, in µs; `asks`: its sender wants a RECEIPT."""

    topic_id: int
    entry_id: int
    age_us: int
    asks: bool = False


class Beacon(NamedTuple):
    """I am here: `boot_id` changes with every start, `number` counts up modulo 2^16."""

    boot_id: int
    number: int


class LinkReport(NamedTuple):
    """How well the sender of this record hears `node`.

    SNR in quarter decibels (signed), PER in 1/255, the MCS it would like to hear.
    """

    node: int
    snr_quarter_db: int
    per_255: int
    mcs: int


class Frame(NamedTuple):
    """The sender's TDMA schedule: whose it is, over how many hops it came, which, and where it
    stands: µs since the frame began, at this burst's preamble.
    """

    root: int
    level: int
    schedule: int
    phase_us: int


class Receipt(NamedTuple):
    """What became of a message of `node` here (255: of whoever this PDU is for), its age then
    (65535: not known, or older), and what has passed since; both in 0.1 ms.
    """

    topic_id: int
    entry_id: int
    status: int
    node: int = BROADCAST
    age_100us: int = NO_AGE
    since_100us: int = 0


class Waits(NamedTuple):
    """Of what messages of a topic waited at their source, the shares in 1/255: in the queue, for
    the air, and for another chance after a burst that did not leave.
    """

    topic_id: int
    queue: int
    access: int
    again: int


class Parity(NamedTuple):
    """Octets from `at` on of parity fragment `number` of a message of `total` fragments of `k`
    octets; the message has `size`.
    """

    topic_id: int
    entry_id: int
    total: int
    n_parity: int
    number: int
    at: int
    k: int
    size: int
    data: bytes


FixedRecord = Stamp | Beacon | LinkReport | Receipt | Frame | Waits
Record = FixedRecord | RegistryDigest | Parity | Clock

_TYPES: dict[type[FixedRecord], RecordType] = {
    Stamp: RecordType.STAMP,
    Beacon: RecordType.BEACON,
    LinkReport: RecordType.LINK_REPORT,
    Receipt: RecordType.RECEIPT,
    Frame: RecordType.FRAME,
    Waits: RecordType.WAITS,
}
_FORMATS = {
    RecordType.STAMP: struct.Struct(">BBI"),
    RecordType.BEACON: struct.Struct(">HH"),
    RecordType.LINK_REPORT: struct.Struct(">BbBB"),
    RecordType.RECEIPT: struct.Struct(">BBB"),
    RecordType.FRAME: struct.Struct(">BBHI"),
    RecordType.WAITS: struct.Struct(">BBBB"),
}
# Fields behind those that a record always has.
_ASKS = b"\x01"
_WHOSE = struct.Struct(">BHH")
# What the parser needs of a type, by its number: the fields' class and format.
_KNOWN = {int(number): (kind, _FORMATS[number]) for kind, number in _TYPES.items()}

_PARITY = struct.Struct(">BBBBBHHI")
PARITY_OVERHEAD = TLV_HEADER_SIZE + _PARITY.size
"""Of a record, beside the octets of parity."""
STAMP_SIZE = TLV_HEADER_SIZE + _FORMATS[RecordType.STAMP].size
_STAMP_RECORD = struct.Struct(">BBBBI")
ASKING_STAMP_SIZE = STAMP_SIZE + len(_ASKS)


def build_records(records: Iterable[Record]) -> bytes:
    """The payload of one control entry. Raises ValueError when a field is out of range."""
    return b"".join(_build(record) for record in records)


def build_stamp(topic_id: int, entry_id: int, age_us: int, asks: bool = False) -> bytes:
    """A STAMP record: every message has one, so it is built without detours."""
    value_size = STAMP_SIZE - TLV_HEADER_SIZE + asks
    record = _STAMP_RECORD.pack(RecordType.STAMP, value_size, topic_id, entry_id, age_us)
    return bytes(record + _ASKS if asks else record)


def parse_records(payload: bytes) -> list[Record]:
    """The records in a control entry's payload; unknown types are skipped.

    A known record may be longer than we know it: later versions append fields. Raises PduError
    (rx_entry) when a record overruns the payload or is too short for its type.
    """
    records: list[Record] = []
    at, end = 0, len(payload)
    while at < end:
        if at + TLV_HEADER_SIZE > end:
            raise PduError("rx_entry", "a control record is cut in its header")
        number, length = payload[at], payload[at + 1]
        at += TLV_HEADER_SIZE
        if at + length > end:
            raise PduError("rx_entry", f"control record {number} of {length} bytes overruns")
        if number in _KNOWN:
            kind, fields = _KNOWN[number]
            if length < fields.size:
                raise PduError("rx_entry", f"control record {number} has only {length} bytes")
            record = kind(*fields.unpack_from(payload, at))
            if length > fields.size:
                record = _with_more(record, payload[at + fields.size : at + length])
            records.append(record)
        elif number == RecordType.DIGEST:
            if length < RegistryDigest.OVERALL_SIZE:
                raise PduError("rx_entry", f"control record {number} has only {length} bytes")
            records.append(RegistryDigest.from_bytes(payload[at : at + length]))
        elif number == RecordType.PARITY:
            if length < _PARITY.size:
                raise PduError("rx_entry", f"control record {number} has only {length} bytes")
            data = payload[at + _PARITY.size : at + length]
            records.append(Parity._make((*_PARITY.unpack_from(payload, at), data)))
        elif number == RecordType.CLOCK:
            records.append(parse_clock(payload[at : at + length]))
        at += length
    return records


def _build(record: Record) -> bytes:
    if isinstance(record, RegistryDigest):
        number, value = RecordType.DIGEST, record.overall + record.per_topic
        if len(record.overall) != RegistryDigest.OVERALL_SIZE or len(value) > MAX_VALUE_SIZE:
            raise ValueError(f"a digest is 8 octets, and one a topic: {record}")
    elif isinstance(record, Parity):
        number = RecordType.PARITY
        try:
            value = _PARITY.pack(*record[:-1]) + record.data
        except struct.error as error:
            raise ValueError(f"{record} does not fit its record: {error}") from None
        if len(value) > MAX_VALUE_SIZE:
            raise ValueError(f"{len(record.data)} octets of parity do not fit a record")
    else:
        number = RecordType.CLOCK if isinstance(record, Clock) else _TYPES[type(record)]
        try:
            value = build_clock(record) if isinstance(record, Clock) else _fixed(record, number)
        except struct.error as error:
            raise ValueError(f"{record} does not fit its record: {error}") from None
        if len(value) > MAX_VALUE_SIZE:
            raise ValueError(f"{record} does not fit its record")
    return bytes((number, len(value))) + value


def _fixed(record: FixedRecord, number: RecordType) -> bytes:
    fields = _FORMATS[number]
    if isinstance(record, Stamp):
        return fields.pack(*record[:3]) + _ASKS * record.asks
    if isinstance(record, Receipt):
        is_whole = record[3:] != (BROADCAST, NO_AGE, 0)
        return fields.pack(*record[:3]) + (_WHOSE.pack(*record[3:]) if is_whole else b"")
    return fields.pack(*record)


def _with_more(record: FixedRecord, more: bytes) -> FixedRecord:
    """With the fields behind those that its type always has; what is not known is left out."""
    if isinstance(record, Stamp):
        return record._replace(asks=bool(more[0] & _ASKS[0]))
    if isinstance(record, Receipt) and len(more) >= _WHOSE.size:
        return Receipt(*record[:3], *_WHOSE.unpack_from(more))
    return record
