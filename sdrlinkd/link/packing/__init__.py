"""PDUs made of the messages that go next.

This room owns entry ids, the fragments that a message is cut into, and the records that ride where
room is left. It is told how much may be packed, and never decides when something leaves.
"""

from sdrlinkd.link.packing.composer import Composer, ComposerReport
from sdrlinkd.link.packing.draft import BuiltPdu
from sdrlinkd.link.packing.flush import flush_told
from sdrlinkd.link.packing.parity import is_sound, missing_fragments, parity_records
from sdrlinkd.link.packing.piggyback import PiggybackRecords

__all__ = [
    "BuiltPdu",
    "Composer",
    "ComposerReport",
    "PiggybackRecords",
    "flush_told",
    "is_sound",
    "missing_fragments",
    "parity_records",
]
