"""The OFDM modem: bits to samples and back.

The arithmetic of bursts (their sizes, rates and error rates) is at hand at once. What touches
samples is loaded on first use: a program that only plans never loads it. `Receiver` and
`Transmitter` are those of the engine in use.
"""

import importlib
from typing import TYPE_CHECKING

from phy.constellation import Modulation, points
from phy.error_rate import (
    burst_found_rate,
    needed_snr_db,
    pdu_error_rate,
    pdu_lost_rate,
)
from phy.expected import Expected, OtherLink
from phy.header import MAX_PDU_BYTES, MAX_PDUS, N_NETWORKS
from phy.layout import BurstLayout, layout, most_pdus
from phy.mcs import MCS_TABLE, SLOWER_MCS, Mcs
from phy.numerology import GRIDS, OFDM_64_8, OFDM_64_16, Numerology
from phy.quality import COUNTERS, BurstOver, BurstQuality, Claim, Event, PduHeard
from phy.sizes import N_PULSE, SENSE_WINDOW

if TYPE_CHECKING:
    from phy.channel import PROFILES, FrontEnd, FrontEndParams, Jammer, Path, PathParams
    from phy.engine import Engine, EngineError
    from phy.excisor import Excisor, Line
    from phy.oversampling import REACH, Downsampler, upsample
    from phy.pulses import pulse
    from phy.receiver import Receiver
    from phy.sensing import EnergyDetector
    from phy.transmitter import Transmitter
    from phy.warmup import warm_up

__all__ = [
    "COUNTERS",
    "GRIDS",
    "MAX_PDUS",
    "MAX_PDU_BYTES",
    "MCS_TABLE",
    "N_NETWORKS",
    "N_PULSE",
    "OFDM_64_8",
    "OFDM_64_16",
    "PROFILES",
    "REACH",
    "SENSE_WINDOW",
    "SLOWER_MCS",
    "BurstLayout",
    "BurstOver",
    "BurstQuality",
    "Claim",
    "Downsampler",
    "EnergyDetector",
    "Engine",
    "EngineError",
    "Event",
    "Excisor",
    "Expected",
    "FrontEnd",
    "FrontEndParams",
    "Jammer",
    "Line",
    "Mcs",
    "Modulation",
    "Numerology",
    "OtherLink",
    "Path",
    "PathParams",
    "PduHeard",
    "Receiver",
    "Transmitter",
    "burst_found_rate",
    "layout",
    "most_pdus",
    "needed_snr_db",
    "pdu_error_rate",
    "pdu_lost_rate",
    "points",
    "pulse",
    "upsample",
    "warm_up",
]

_LATER = {
    "phy.channel": ("PROFILES", "FrontEnd", "FrontEndParams", "Jammer", "Path", "PathParams"),
    "phy.engine": ("Engine", "EngineError"),
    "phy.excisor": ("Excisor", "Line"),
    "phy.oversampling": ("REACH", "Downsampler", "upsample"),
    "phy.pulses": ("pulse",),
    "phy.sensing": ("EnergyDetector",),
    "phy.warmup": ("warm_up",),
}


def __getattr__(name: str) -> object:
    """Import an attribute on first use (PEP 562)."""
    if name in {"Receiver", "Transmitter"}:
        used = importlib.import_module("phy.engine").in_use()
        kind: object = used.receiver if name == "Receiver" else used.transmitter
        return kind
    for module, names in _LATER.items():
        if name in names:
            found: object = getattr(importlib.import_module(module), name)
            globals()[name] = found
            return found
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
