"""What tests look at, piece by piece; not part of the interface."""

from types import ModuleType

from sdrlinkd.modem.clock import BlockTimes, Seen, StreamClock
from sdrlinkd.modem.modem import BurstOrder
from sdrlinkd.modem.plan import AirPlan, TxWindowPlan
from sdrlinkd.modem.process import life
from sdrlinkd.modem.process.load import LoadMeter
from sdrlinkd.modem.process.page import MOST_PULSES, Page, Shown
from sdrlinkd.modem.process.receiving import MAX_BLOCKS, ReceiverHere, ReceiverThread
from sdrlinkd.modem.process.sensing_receiver import TAIL, VANISHED, SensingReceiver
from sdrlinkd.modem.process.transmission import SHORT, Transmission
from sdrlinkd.modem.tempo import OVERHEAD_S, Tempo
from sdrlinkd.modem.traits import HANDOVER_S
from sdrlinkd.modem.turns import INFINITE, Turns

__all__ = [
    "CONSTANTS",
    "HANDOVER_S",
    "INFINITE",
    "MAX_BLOCKS",
    "MOST_PULSES",
    "OVERHEAD_S",
    "SHORT",
    "TAIL",
    "VANISHED",
    "AirPlan",
    "BlockTimes",
    "BurstOrder",
    "LoadMeter",
    "Page",
    "ReceiverHere",
    "ReceiverThread",
    "Seen",
    "SensingReceiver",
    "Shown",
    "StreamClock",
    "Tempo",
    "Transmission",
    "Turns",
    "TxWindowPlan",
]

CONSTANTS: dict[str, tuple[ModuleType, str]] = {
    "hung_s": (life, "HUNG_S"),
    "watch_s": (life, "WATCH_S"),
}
"""Constants that tests replace: `monkeypatch.setattr(*CONSTANTS["hung_s"], 0.5)`."""
