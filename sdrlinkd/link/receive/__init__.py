"""Receives PDUs and turns them into messages.

This package holds the reassembly, the duplicate filter, message ages, and the state of neighbors.
It never sends; it reports events to its caller instead.
"""

from sdrlinkd.link.receive.ages import MAX_WAITING, Ages
from sdrlinkd.link.receive.deadman import Deadman
from sdrlinkd.link.receive.delivered import (
    CDR_HEADER_SIZE,
    DELIVERED,
    NOT_RETAINED,
    Delivered,
    MessageName,
    Retain,
)
from sdrlinkd.link.receive.duplicates import SequenceTrack
from sdrlinkd.link.receive.events import (
    Ended,
    Event,
    Newcomer,
    PduHeard,
    PduPlaced,
    RecordHeard,
    Signal,
)
from sdrlinkd.link.receive.latency import Latency, Parts
from sdrlinkd.link.receive.neighbors import LONGEST_GAP_S, PRESENT_S, Neighbor, Neighbors
from sdrlinkd.link.receive.reception import Reception
from sdrlinkd.link.receive.recorded import HEAD, TAIL
from sdrlinkd.link.receive.repeated import can_be_true

__all__ = [
    "CDR_HEADER_SIZE",
    "DELIVERED",
    "HEAD",
    "LONGEST_GAP_S",
    "MAX_WAITING",
    "NOT_RETAINED",
    "PRESENT_S",
    "TAIL",
    "Ages",
    "Deadman",
    "Delivered",
    "Ended",
    "Event",
    "Latency",
    "MessageName",
    "Neighbor",
    "Neighbors",
    "Newcomer",
    "Parts",
    "PduHeard",
    "PduPlaced",
    "Reception",
    "RecordHeard",
    "Retain",
    "SequenceTrack",
    "Signal",
    "can_be_true",
]
