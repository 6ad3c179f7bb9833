"""The burst scheduler's report."""

from collections.abc import Mapping, Sequence
from math import inf
from typing import NamedTuple

from sdrlinkd.link.access import Settled
from sdrlinkd.link.qos import Qos
from sdrlinkd.link.transmit.rate import RateChange

NOTHING_USED: Mapping[Qos, float] = dict.fromkeys(Qos, 0.0)
NO_BURSTS: Mapping[int, int] = {}


class TransmitReport(NamedTuple):
    """What was sent, how, and by which access policy; the defaults apply without a radio."""

    settled: Settled | None = None
    """The access policy in force; None without a radio."""
    bytes_per_s: float = inf
    """Present capacity of the channel in payload bytes per s; infinity while it is unknown."""
    used_s: Mapping[Qos, float] = NOTHING_USED
    """Airtime composed, by the class of each PDU, in s; includes bursts that failed."""
    airtime_s: float = 0.0
    control_airtime_s: float = 0.0
    bursts_by_mcs: Mapping[int, int] = NO_BURSTS
    bursts_sent: int = 0
    bursts_failed: int = 0
    bursts_late: int = 0
    pdus_sent: int = 0
    pdus_failed: int = 0
    mcs_lowest: int | None = None
    """Slowest MCS that may be chosen; None: the MCS is fixed."""
    mcs_changes: Sequence[RateChange] = ()
