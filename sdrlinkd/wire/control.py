"""Control records: TLVs in entries of topic id 0xF (wire document, section 6)."""

import struct
from dataclasses import dataclass
from enum import IntEnum
from typing import ClassVar

from sdrlinkd.errors import PduError
from sdrlinkd.wire.registry import RegistryDigest

TLV_HEADER_SIZE = 2
MAX_AGE_US = 0xFFFFFFFF


class RecordType(IntEnum):
    """First byte of a record. Numbers are never reused."""

    STAMP = 1
    BEACON = 2
    DIGEST = 3
    LINK_REPORT = 4
    RECEIPT = 5
    PARITY = 6
    FRAME = 7


@dataclass(frozen=True, slots=True)
class Stamp:
    """Age of a message at this burst's preamble, in µs."""

    topic_id: int
    entry_id: int
    age_us: int

    TYPE: ClassVar = RecordType.STAMP
    FORMAT: ClassVar = struct.Struct(">BBI")
    SIZE: ClassVar = TLV_HEADER_SIZE + 6


@dataclass(frozen=True, slots=True)
class Beacon:
    """I am here: `boot_id` changes with every start, `number` counts up modulo 2^16."""

    boot_id: int
    number: int

    TYPE: ClassVar = RecordType.BEACON
    FORMAT: ClassVar = struct.Struct(">HH")


@dataclass(frozen=True, slots=True)
class LinkReport:
    """How well the sender of this record hears `node`.

    SNR in quarter decibels (signed), PER in 1/255, the MCS it would like to hear.
    """

    node: int
    snr_quarter_db: int
    per_255: int
    mcs: int

    TYPE: ClassVar = RecordType.LINK_REPORT
    FORMAT: ClassVar = struct.Struct(">BbBB")


@dataclass(frozen=True, slots=True)
class Receipt:
    """What became of a message at the far end."""

    topic_id: int
    entry_id: int
    status: int

    TYPE: ClassVar = RecordType.RECEIPT
    FORMAT: ClassVar = struct.Struct(">BBB")


Record = Stamp | Beacon | LinkReport | Receipt | RegistryDigest

_BY_TYPE: dict[int, type[Stamp] | type[Beacon] | type[LinkReport] | type[Receipt]] = {
    kind.TYPE: kind for kind in (Stamp, Beacon, LinkReport, Receipt)
}
_DIGEST_SIZE = 8


def build_records(records: list[Record]) -> bytes:
    """The payload of one control entry. Raises ValueError when a field is out of range."""
    return b"".join(_build(record) for record in records)


def parse_records(payload: bytes) -> list[Record]:
    """The records in a control entry's payload; unknown types are skipped.

    A known record may be longer than we know it: later versions append fields. Raises PduError
    (rx_entry) when a record overruns the payload or is too short for its type.
    """
    records: list[Record] = []
    at = 0
    while at < len(payload):
        if at + TLV_HEADER_SIZE > len(payload):
            raise PduError("rx_entry", "a control record is cut in its header")
        kind, length = payload[at], payload[at + 1]
        at += TLV_HEADER_SIZE
        value = payload[at : at + length]
        if len(value) != length:
            raise PduError("rx_entry", f"control record {kind} of {length} bytes overruns")
        at += length
        known = _BY_TYPE.get(kind)
        if known is not None:
            if length < known.FORMAT.size:
                raise PduError("rx_entry", f"control record {kind} has only {length} bytes")
            records.append(known(*known.FORMAT.unpack_from(value)))
        elif kind == RecordType.DIGEST:
            if length < _DIGEST_SIZE:
                raise PduError("rx_entry", f"control record {kind} has only {length} bytes")
            records.append(RegistryDigest(value[:_DIGEST_SIZE], value[_DIGEST_SIZE:]))
    return records


def _build(record: Record) -> bytes:
    if isinstance(record, RegistryDigest):
        value = record.overall + record.per_topic
        return bytes((RecordType.DIGEST, len(value))) + value
    fields = [getattr(record, name) for name in record.__slots__]
    try:
        value = record.FORMAT.pack(*fields)
    except struct.error as error:
        raise ValueError(f"{record} does not fit its record: {error}") from None
    return bytes((record.TYPE, len(value))) + value
