"""Clocks of other robots, from when bursts were sent and heard.

This room owns what is known of each robot's clock, and the CLOCK records that tell of ours. It
reads no clock, and decides nothing of when a record is sent.
"""

from sdrlinkd.link.timesync.clocks import ClockParams, Clocks
from sdrlinkd.link.timesync.envelope import DualEnvelope, Estimate
from sdrlinkd.link.timesync.paper import PaperFilter
from sdrlinkd.link.timesync.peer import PeerClock, State, Wall
from sdrlinkd.link.timesync.side import Side

__all__ = [
    "ClockParams",
    "Clocks",
    "DualEnvelope",
    "Estimate",
    "PaperFilter",
    "PeerClock",
    "Side",
    "State",
    "Wall",
]
