"""Packs the next messages of the queue into PDUs.

This package holds entry ids, the fragments of messages, and the control records that use spare
room. Its callers decide how much it may pack, and when a PDU leaves.
"""

from sdrlinkd.link.packing.composer import MAX_PDUS, Composer
from sdrlinkd.link.packing.draft import BuiltPdu
from sdrlinkd.link.packing.entry_ids import TopicEntryIds
from sdrlinkd.link.packing.flush import flush_told
from sdrlinkd.link.packing.parity import is_sound, missing_fragments, parity_pdus, parity_records
from sdrlinkd.link.packing.piggyback import PiggybackRecords
from sdrlinkd.link.packing.report import ComposerReport

__all__ = [
    "MAX_PDUS",
    "BuiltPdu",
    "Composer",
    "ComposerReport",
    "PiggybackRecords",
    "TopicEntryIds",
    "flush_told",
    "is_sound",
    "missing_fragments",
    "parity_pdus",
    "parity_records",
]
