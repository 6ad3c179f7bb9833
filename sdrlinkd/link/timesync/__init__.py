"""Estimates other robots' clocks from the times at which bursts were sent and heard.

This package holds the estimate of each robot's clock, and makes the CLOCK records about ours. It
reads no clock, and does not decide when a record is sent.
"""

from sdrlinkd.link.timesync.clocks import ClockParams, Clocks
from sdrlinkd.link.timesync.envelope import DualEnvelope
from sdrlinkd.link.timesync.estimate import Estimate
from sdrlinkd.link.timesync.paper import PaperFilter
from sdrlinkd.link.timesync.peer import PeerClock, State, Wall
from sdrlinkd.link.timesync.side import Side
from sdrlinkd.link.timesync.wander import Wander
from sdrlinkd.link.timesync.way import STEP_S, WINDOW_S

__all__ = [
    "STEP_S",
    "WINDOW_S",
    "ClockParams",
    "Clocks",
    "DualEnvelope",
    "Estimate",
    "PaperFilter",
    "PeerClock",
    "Side",
    "State",
    "Wall",
    "Wander",
]
