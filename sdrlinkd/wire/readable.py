"""Reads the control entries of a PDU, and skips unreadable ones (wire document, section 6)."""

from typing import NamedTuple

from sdrlinkd.errors import PduError
from sdrlinkd.wire.control import Record, parse_records
from sdrlinkd.wire.pdu import Pdu
from sdrlinkd.wire.registry import CONTROL_TOPIC_ID


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
