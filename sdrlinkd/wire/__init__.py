"""The wire format, version 0: PDUs, entries, control records, registry, reassembly.

Bytes in, fields out, and back. The document beside this file says what the bytes mean.
"""

from sdrlinkd.wire.builder import VERSION, PduBuilder
from sdrlinkd.wire.capacity import (
    CRC_SIZE,
    ENTRY_HEADER_SIZE,
    HEADER_SIZE,
    MAX_ENTRIES,
    MAX_FRAGMENTS,
    MAX_PDU_SIZE,
    MIN_PDU_SIZE,
    entry_budget,
    equal_payload,
    fragment_count,
    max_message_size,
    pad_length,
)
from sdrlinkd.wire.control import (
    MAX_AGE_US,
    STAMP_SIZE,
    Beacon,
    Frame,
    LinkReport,
    Receipt,
    Record,
    RecordType,
    Stamp,
    build_records,
    build_stamp,
    parse_records,
)
from sdrlinkd.wire.later import postponed
from sdrlinkd.wire.pdu import BROADCAST, Entry, Pdu, build, flags, identity, parse
from sdrlinkd.wire.reassembly import Lost, Reassembly, ReassemblyLimits
from sdrlinkd.wire.registry import (
    CONTROL_TOPIC_ID,
    MAX_TOPICS,
    Registry,
    RegistryDigest,
    Topic,
    make_registry,
    parse_registry,
)

__all__ = [
    "BROADCAST",
    "CONTROL_TOPIC_ID",
    "CRC_SIZE",
    "ENTRY_HEADER_SIZE",
    "HEADER_SIZE",
    "MAX_AGE_US",
    "MAX_ENTRIES",
    "MAX_FRAGMENTS",
    "MAX_PDU_SIZE",
    "MAX_TOPICS",
    "MIN_PDU_SIZE",
    "STAMP_SIZE",
    "VERSION",
    "Beacon",
    "Entry",
    "Frame",
    "LinkReport",
    "Lost",
    "Pdu",
    "PduBuilder",
    "Reassembly",
    "ReassemblyLimits",
    "Receipt",
    "Record",
    "RecordType",
    "Registry",
    "RegistryDigest",
    "Stamp",
    "Topic",
    "build",
    "build_records",
    "build_stamp",
    "entry_budget",
    "equal_payload",
    "flags",
    "fragment_count",
    "identity",
    "make_registry",
    "max_message_size",
    "pad_length",
    "parse",
    "parse_records",
    "parse_registry",
    "postponed",
]
