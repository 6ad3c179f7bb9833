"""Bursts: when one leaves, how long it is and how fast, and what goes again.

This room owns the burst scheduler, the choice of MCS, the retry queue and the pace of control
records. It asks `access` when the air is ours, and `packing` for PDUs.
"""

from sdrlinkd.link.transmit.air_use import AirUse
from sdrlinkd.link.transmit.beacons import Beacons
from sdrlinkd.link.transmit.burst import Burst, Outcome
from sdrlinkd.link.transmit.control_records import MOST_RECEIPTS, PRESENT_S, ControlRecords
from sdrlinkd.link.transmit.rate import (
    HIGH_PER,
    KEPT_CHANGES,
    LOW_PER,
    MAX_PENALTY_DB,
    PENALTY_DECAY_DB,
    PENALTY_STEP_DB,
    RateChange,
    RateControl,
    RateParams,
)
from sdrlinkd.link.transmit.retry import GIVE_UP_S
from sdrlinkd.link.transmit.scheduler import BurstScheduler
from sdrlinkd.link.transmit.sender import Sender

__all__ = [
    "GIVE_UP_S",
    "HIGH_PER",
    "KEPT_CHANGES",
    "LOW_PER",
    "MAX_PENALTY_DB",
    "MOST_RECEIPTS",
    "PENALTY_DECAY_DB",
    "PENALTY_STEP_DB",
    "PRESENT_S",
    "AirUse",
    "Beacons",
    "Burst",
    "BurstScheduler",
    "ControlRecords",
    "Outcome",
    "RateChange",
    "RateControl",
    "RateParams",
    "Sender",
]
