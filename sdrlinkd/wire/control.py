"""Control records: TLVs in entries of topic id 0xF (wire document, section 6)."""

import struct
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

from sdrlinkd.errors import PduError
from sdrlinkd.wire.clock import CLOCK_SIZE, Clock, build_clock, parse_clock
from sdrlinkd.wire.contact import (
    CONTACT_NUMBER_SIZE,
    FOUND_SIZE,
    KEY_SIZE,
    LOST_SIZE,
    Contact,
    FoundNumbers,
    KeyTold,
    LostNumbers,
    build_contact,
    build_found,
    build_key,
    build_lost,
    parse_contact,
    parse_found,
    parse_key,
    parse_lost,
)
from sdrlinkd.wire.declared import TopicPiece, build_topic, parse_topic
from sdrlinkd.wire.granting import (
    GRANT_OVERHEAD,
    WANT_SIZE,
    Grant,
    Want,
    build_grant,
    build_want,
    parse_grant,
    parse_want,
)
from sdrlinkd.wire.rates import RATE_OVERHEAD, RatesAsked, build_rates, parse_rates
from sdrlinkd.wire.record_types import (
    NO_AGE,
    Beacon,
    Frame,
    LinkReport,
    Parity,
    Receipt,
    RecordType,
    Stamp,
    Waits,
    Wanted,
)
from sdrlinkd.wire.registry import BROADCAST, RegistryDigest
from sdrlinkd.wire.repeat import (
    BARE_OVERHEAD,
    NEED_OVERHEAD,
    PDU_NUMBER,
    REPEAT_SIZE,
    Bare,
    Need,
    Repeat,
    build_bare,
    build_need,
    build_repeat,
    parse_bare,
    parse_need,
    parse_repeat,
)
from sdrlinkd.wire.reserving import (
    ADMIT_OVERHEAD,
    FLOWS_OVERHEAD,
    Admit,
    Flows,
    build_admit,
    build_flows,
    parse_admit,
    parse_flows,
)
from sdrlinkd.wire.routing import (
    LSA_OVERHEAD,
    ROUTE_OVERHEAD,
    Lsa,
    Route,
    build_lsa,
    build_route,
    parse_lsa,
    parse_route,
)

TLV_HEADER_SIZE = 2
MAX_AGE_US = 0xFFFFFFFF
MAX_VALUE_SIZE = 255
RECEIPT_UNIT_US = 100
RECEIPT_UNIT_S = RECEIPT_UNIT_US / 1e6
MAX_SINCE = 0xFFFF
"""Largest time in a RECEIPT, in units of 0.1 ms."""


FixedRecord = Stamp | Beacon | LinkReport | Receipt | Frame | Waits
Record = (
    FixedRecord
    | RegistryDigest
    | Parity
    | Clock
    | TopicPiece
    | Wanted
    | Contact
    | KeyTold
    | Need
    | Repeat
    | Lsa
    | Route
    | Bare
    | Want
    | Grant
    | Flows
    | Admit
    | LostNumbers
    | FoundNumbers
    | RatesAsked
)

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
ASKS = b"\x01"
_WHOSE = struct.Struct(">BHH")
_KNOWN = {int(number): (kind, _FORMATS[number]) for kind, number in _TYPES.items()}

_PARITY = struct.Struct(">BBBBBHHI")
PARITY_OVERHEAD = TLV_HEADER_SIZE + _PARITY.size
"""Octets of a PARITY record without its parity."""
TOPIC_OVERHEAD = TLV_HEADER_SIZE + 4
"""Octets of a TOPIC record without its piece of the description."""
WANTED_OVERHEAD = TLV_HEADER_SIZE + 1
"""Octets of a WANTED record without its topics."""
STAMP_SIZE = TLV_HEADER_SIZE + _FORMATS[RecordType.STAMP].size
FRAME_SIZE = TLV_HEADER_SIZE + _FORMATS[RecordType.FRAME].size
STAMP_RECORD = struct.Struct(">BBBBI")
ASKING_STAMP_SIZE = STAMP_SIZE + len(ASKS)
# Smallest length of a record's value in octets, by type number.
_LEAST = {
    **{int(number): fields.size for number, fields in _FORMATS.items()},
    int(RecordType.DIGEST): RegistryDigest.OVERALL_SIZE,
    int(RecordType.PARITY): _PARITY.size,
    int(RecordType.CLOCK): CLOCK_SIZE - TLV_HEADER_SIZE,
    int(RecordType.TOPIC): TOPIC_OVERHEAD - TLV_HEADER_SIZE,
    int(RecordType.WANTED): WANTED_OVERHEAD - TLV_HEADER_SIZE,
    int(RecordType.CONTACT): CONTACT_NUMBER_SIZE,
    int(RecordType.KEY): KEY_SIZE,
    int(RecordType.NEED): NEED_OVERHEAD - TLV_HEADER_SIZE + 1,
    int(RecordType.REPEAT): REPEAT_SIZE - TLV_HEADER_SIZE,
    int(RecordType.BARE): BARE_OVERHEAD - TLV_HEADER_SIZE + 1,
    int(RecordType.LSA): LSA_OVERHEAD - TLV_HEADER_SIZE,
    int(RecordType.ROUTE): ROUTE_OVERHEAD - TLV_HEADER_SIZE,
    int(RecordType.WANT): WANT_SIZE - TLV_HEADER_SIZE,
    int(RecordType.GRANT): GRANT_OVERHEAD - TLV_HEADER_SIZE,
    int(RecordType.FLOWS): FLOWS_OVERHEAD - TLV_HEADER_SIZE,
    int(RecordType.ADMIT): ADMIT_OVERHEAD - TLV_HEADER_SIZE,
    int(RecordType.LOST): LOST_SIZE,
    int(RecordType.FOUND): FOUND_SIZE,
    int(RecordType.RATE): RATE_OVERHEAD,
}


_READERS: dict[int, Callable[[bytes], Record]] = {
    RecordType.DIGEST: RegistryDigest.from_bytes,
    RecordType.PARITY: lambda value: Parity._make(
        (*_PARITY.unpack_from(value), value[_PARITY.size :])
    ),
    RecordType.CLOCK: parse_clock,
    RecordType.TOPIC: parse_topic,
    RecordType.WANTED: lambda value: Wanted(value[0], bytes(value[1:])),
    RecordType.CONTACT: parse_contact,
    RecordType.KEY: parse_key,
    RecordType.NEED: parse_need,
    RecordType.REPEAT: parse_repeat,
    RecordType.BARE: parse_bare,
    RecordType.LSA: parse_lsa,
    RecordType.ROUTE: parse_route,
    RecordType.WANT: parse_want,
    RecordType.GRANT: parse_grant,
    RecordType.FLOWS: parse_flows,
    RecordType.ADMIT: parse_admit,
    RecordType.LOST: parse_lost,
    RecordType.FOUND: parse_found,
    RecordType.RATE: parse_rates,
}
"""Readers of the values of records without fixed fields, by type number."""


def build_records(records: Iterable[Record]) -> bytes:
    """The payload of one control entry. Raises ValueError if a field is out of range."""
    return b"".join(_build(record) for record in records)


def record_spans(octets: bytes | bytearray, begin: int, end: int) -> list[tuple[int, int, int]]:
    """(type, start of the value, its length) of the records in the payload `octets[begin:end]`.

    Raises PduError (rx_control_bad) if a record overruns the payload or is too short for its type;
    then none of them is used.
    """
    spans = []
    at = begin
    while at < end:
        if at + TLV_HEADER_SIZE > end:
            raise PduError("rx_control_bad", "a control record is truncated in its header")
        number, length = octets[at], octets[at + 1]
        at += TLV_HEADER_SIZE
        if at + length > end:
            raise PduError("rx_control_bad", f"control record {number} of {length} bytes overruns")
        if length < _LEAST.get(number, 0):
            raise PduError("rx_control_bad", f"control record {number} has only {length} bytes")
        spans.append((number, at, length))
        at += length
    return spans


def parse_records(payload: bytes) -> list[Record]:
    """The records in a control entry's payload; unknown types are skipped.

    A known record may be longer than expected, as later versions append fields. Raises PduError
    like `record_spans`.
    """
    records: list[Record] = []
    for number, at, length in record_spans(payload, 0, len(payload)):
        if number in _KNOWN:
            kind, fields = _KNOWN[number]
            record = kind(*fields.unpack_from(payload, at))
            if length > fields.size:
                record = _with_more(record, payload[at + fields.size : at + length])
            records.append(record)
        elif number in _READERS:
            records.append(_READERS[number](payload[at : at + length]))
    return records


def _build_digest(digest: RegistryDigest) -> bytes:
    if len(digest.overall) != RegistryDigest.OVERALL_SIZE:
        raise ValueError(f"a digest is 8 octets, and one a topic: {digest}")
    return digest.overall + digest.per_topic


def _fixed(number: RecordType, record: FixedRecord) -> bytes:
    fields = _FORMATS[number]
    if isinstance(record, Stamp):
        return fields.pack(*record[:3]) + ASKS * record.asks
    if isinstance(record, Beacon):
        told = record.pdu_number
        return fields.pack(*record[:2]) + (b"" if told is None else PDU_NUMBER.pack(told))
    if isinstance(record, Receipt):
        is_whole = record[3:] != (BROADCAST, NO_AGE, 0)
        return fields.pack(*record[:3]) + (_WHOSE.pack(*record[3:]) if is_whole else b"")
    return fields.pack(*record)


_BUILDERS: dict[type[Record], tuple[RecordType, Callable[[Any], bytes]]] = {
    **{kind: (number, partial(_fixed, number)) for kind, number in _TYPES.items()},
    RegistryDigest: (RecordType.DIGEST, _build_digest),
    Parity: (RecordType.PARITY, lambda record: _PARITY.pack(*record[:-1]) + record.data),
    Clock: (RecordType.CLOCK, build_clock),
    TopicPiece: (RecordType.TOPIC, build_topic),
    Wanted: (RecordType.WANTED, lambda record: bytes((record.node,)) + record.topics),
    Contact: (RecordType.CONTACT, build_contact),
    KeyTold: (RecordType.KEY, build_key),
    Need: (RecordType.NEED, build_need),
    Repeat: (RecordType.REPEAT, build_repeat),
    Bare: (RecordType.BARE, build_bare),
    Lsa: (RecordType.LSA, build_lsa),
    Route: (RecordType.ROUTE, build_route),
    Want: (RecordType.WANT, build_want),
    Grant: (RecordType.GRANT, build_grant),
    Flows: (RecordType.FLOWS, build_flows),
    Admit: (RecordType.ADMIT, build_admit),
    LostNumbers: (RecordType.LOST, build_lost),
    FoundNumbers: (RecordType.FOUND, build_found),
    RatesAsked: (RecordType.RATE, build_rates),
}


def _build(record: Record) -> bytes:
    number, build = _BUILDERS[type(record)]
    try:
        value = build(record)
    except struct.error as error:
        raise ValueError(f"{record} does not fit its record: {error}") from None
    if len(value) > MAX_VALUE_SIZE:
        raise ValueError(f"{record} does not fit its record")
    return bytes((number, len(value))) + value


def _with_more(record: FixedRecord, more: bytes) -> FixedRecord:
    """The record with the optional fields in `more`; unknown fields are ignored."""
    if isinstance(record, Stamp):
        return record._replace(asks=bool(more[0] & ASKS[0]))
    if isinstance(record, Beacon) and len(more) >= PDU_NUMBER.size:
        return record._replace(pdu_number=PDU_NUMBER.unpack_from(more)[0])
    if isinstance(record, Receipt) and len(more) >= _WHOSE.size:
        return Receipt(*record[:3], *_WHOSE.unpack_from(more))
    return record
