"""Bursts: when they leave, their length and MCS, and retries.

This package holds the burst scheduler, rate control, the retry queue and the timing of control
records. It queries `access` for slots and `packing` for PDUs.
"""

from sdrlinkd.link.transmit.beacons import Beacons
from sdrlinkd.link.transmit.burst import Burst, Outcome
from sdrlinkd.link.transmit.control_records import MOST_RECEIPTS, ControlRecords
from sdrlinkd.link.transmit.fit import Fit, fit_to
from sdrlinkd.link.transmit.motion import longest_burst_s
from sdrlinkd.link.transmit.no_radio import NoRadio
from sdrlinkd.link.transmit.own_flows import OwnFlows
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
from sdrlinkd.link.transmit.report import TransmitReport
from sdrlinkd.link.transmit.retry import GIVE_UP_S
from sdrlinkd.link.transmit.scheduler import BurstScheduler
from sdrlinkd.link.transmit.tx_delay import TxDelayMeters

__all__ = [
    "GIVE_UP_S",
    "HIGH_PER",
    "KEPT_CHANGES",
    "LOW_PER",
    "MAX_PENALTY_DB",
    "MOST_RECEIPTS",
    "PENALTY_DECAY_DB",
    "PENALTY_STEP_DB",
    "Beacons",
    "Burst",
    "BurstScheduler",
    "ControlRecords",
    "Fit",
    "NoRadio",
    "Outcome",
    "OwnFlows",
    "RateChange",
    "RateControl",
    "RateParams",
    "TransmitReport",
    "TxDelayMeters",
    "fit_to",
    "longest_burst_s",
]
