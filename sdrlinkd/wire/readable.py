"""Reads control entries and the numbers of declared topics, and skips what is unreadable.

See sections 6 and 4.4 of the wire document.
"""

from typing import NamedTuple

from sdrlinkd.errors import PduError
from sdrlinkd.wire.control import Record, parse_records
from sdrlinkd.wire.declared import FIRST_NUMBER, PARTS
from sdrlinkd.wire.pdu import Entry, Pdu
from sdrlinkd.wire.record_types import Parity, Stamp
from sdrlinkd.wire.registry import CONTROL_TOPIC_ID, DECLARED_TOPIC_ID


class ControlEntries(NamedTuple):
    """The `records` of all readable control entries; `n_bad` of the `n_entries` are unreadable."""

    records: list[Record]
    n_entries: int
    n_bad: int


def read_control_entries(pdu: Pdu) -> ControlEntries:
    """The control entries of a PDU with control channel.

    An unreadable entry is skipped completely; the other entries are still used.
    """
    records: list[Record] = []
    n_entries = n_bad = 0
    for entry in pdu.entries:
        if entry.topic_id != CONTROL_TOPIC_ID:
            continue
        n_entries += 1
        if entry.total != 1:
            # Control records are never fragmented.
            n_bad += 1
            continue
        try:
            records += parse_records(entry.payload)
        except PduError:
            n_bad += 1
    return ControlEntries(records, n_entries, n_bad)


def numbered(pdu: Pdu) -> Pdu:
    """`pdu` with the numbers of its entries under topic id 0xE as their topic ids.

    Entries without a valid number are left out.
    """
    if all(entry.topic_id != DECLARED_TOPIC_ID for entry in pdu.entries):
        return pdu
    entries = (_numbered(entry) for entry in pdu.entries)
    return pdu._replace(entries=[entry for entry in entries if entry is not None])


def _numbered(entry: Entry) -> Entry | None:
    if entry.topic_id != DECLARED_TOPIC_ID:
        return entry
    number = entry.payload[0] if entry.payload else 1
    if 0 < number < FIRST_NUMBER:
        return None
    return entry._replace(topic_id=number or PARTS, payload=entry.payload[1:])


def with_topic(record: Record) -> Record:
    """A record whose topic octet is replaced by the topic id that it means."""
    if isinstance(record, Stamp | Parity) and record.topic_id == DECLARED_TOPIC_ID:
        return record._replace(topic_id=PARTS)
    return record
