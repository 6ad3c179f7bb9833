"""What tests look at, piece by piece; not part of the interface."""

from sdrlinkd.link.receive.acceptance import Acceptance
from sdrlinkd.link.receive.ages import Origin
from sdrlinkd.link.receive.air_heard import AirHeard
from sdrlinkd.link.receive.completion import Completion
from sdrlinkd.link.receive.door import Door
from sdrlinkd.link.receive.handover import Handover
from sdrlinkd.link.receive.heard_records import HeardRecords
from sdrlinkd.link.receive.pdu_read import PduRead, PduReader
from sdrlinkd.link.receive.recorded import OwnPdus, RecentCommands
from sdrlinkd.link.receive.repeated import Repeated, RepeatedPdus
from sdrlinkd.link.receive.rx_ledger import MOST_TALLIES, Held, RxLedger
from sdrlinkd.link.receive.undeclared import UndeclaredMessages, Whole

__all__ = [
    "MOST_TALLIES",
    "Acceptance",
    "AirHeard",
    "Completion",
    "Door",
    "Handover",
    "HeardRecords",
    "Held",
    "Origin",
    "OwnPdus",
    "PduRead",
    "PduReader",
    "RecentCommands",
    "Repeated",
    "RepeatedPdus",
    "RxLedger",
    "UndeclaredMessages",
    "Whole",
]
