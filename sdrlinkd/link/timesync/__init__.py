"""Clocks of other robots, from when bursts were sent and heard. Nothing here reads a clock."""

from sdrlinkd.link.timesync.clocks import ClockParams, Clocks
from sdrlinkd.link.timesync.envelope import DualEnvelope, Estimate
from sdrlinkd.link.timesync.paper import PaperFilter
from sdrlinkd.link.timesync.peer import PeerClock, State, Wall

__all__ = [
    "ClockParams",
    "Clocks",
    "DualEnvelope",
    "Estimate",
    "PaperFilter",
    "PeerClock",
    "State",
    "Wall",
]
