"""The OFDM modem: bits to samples and back."""

from phy.channel import PROFILES, FrontEnd, FrontEndParams, Path, PathParams
from phy.constellation import Modulation, points
from phy.header import MAX_PDU_BYTES, MAX_PDUS, N_NETWORKS
from phy.layout import BurstLayout, layout, most_pdus
from phy.mcs import MCS_TABLE, Mcs
from phy.numerology import OFDM_64_8, OFDM_64_16, Numerology
from phy.quality import COUNTERS, BurstOver, BurstQuality, Event, PduHeard
from phy.receiver import Receiver
from phy.transmitter import Transmitter
from phy.warmup import warm_up

__all__ = [
    "COUNTERS",
    "MAX_PDUS",
    "MAX_PDU_BYTES",
    "MCS_TABLE",
    "N_NETWORKS",
    "OFDM_64_8",
    "OFDM_64_16",
    "PROFILES",
    "BurstLayout",
    "BurstOver",
    "BurstQuality",
    "Event",
    "FrontEnd",
    "FrontEndParams",
    "Mcs",
    "Modulation",
    "Numerology",
    "Path",
    "PathParams",
    "PduHeard",
    "Receiver",
    "Transmitter",
    "layout",
    "most_pdus",
    "points",
    "warm_up",
]
