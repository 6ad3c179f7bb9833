"""What the link must know of that which carries its PDUs."""

from collections.abc import Callable, Collection
from math import inf
from typing import NamedTuple


class PduLinkTraits(NamedTuple):
    """A radio as access policies and rate control see it; times in s.

    `lead_s`: a burst decided now leaves so much later at the earliest. `react_s`: so long after a
    sample was on the air can a decision follow from it. `detect_s`: so long must a burst last to
    be noticed. `gap_s` stays free between two bursts of one node. `needed_snr_db` and
    `longest_burst_s` are those of each MCS, `pdu_burst_s` is a burst of one PDU.
    """

    kind: str = "direct"
    is_lockstep: bool = False
    """Time is that of the samples, and waits for everybody."""
    transmits: bool = True
    senses: bool = False
    shares_air: bool = False
    """Other robots may be on its air."""
    turnaround_s: float = 0.0
    index_error_s: float = 0.0
    """How wrong times may be after a gap."""
    lead_s: float = 0.0
    react_s: float = 0.0
    detect_s: float = 0.0
    overhead_s: float = 0.0
    """What a burst takes besides its PDUs."""
    gap_s: float = 0.0
    tx_window_s: float = inf
    """It sends without listening for so long at most."""
    tx_window_follow_s: float = 0.0
    """What is decided so long before a burst is over leaves right behind it, else in the next
    TX window."""
    rx_window_s: float = 0.0
    """It listens for so long between two TX windows."""
    ahead_s: float = 0.0
    """A burst whose time is fixed may be decided so much before it has to be."""
    longest_burst_s: tuple[float, ...] = (0.0,)
    """By MCS."""
    pdu_burst_s: tuple[float, ...] = (0.0,)
    mcs: int = 0
    """The fixed one."""
    needed_snr_db: tuple[float, ...] = (0.0,)
    stamp_s: float = 2e-4
    """How wrong the times may be at which bursts left and came."""

    def longest_in_use_s(self, usable: Collection[int]) -> float:
        """The longest burst of any of these MCS."""
        return max(self.longest_burst_s[mcs] for mcs in usable)


class Sensed(NamedTuple):
    """What the receiver knows of the air: it has listened up to `until`.

    The channel is idle since `idle_since`; while it is busy, that is later than `until`. `burst_at`
    is when the last burst's preamble came, None when only its energy was noticed.
    """

    until: float = inf
    idle_since: float = 0.0
    burst_at: float | None = None


class Opportunity(NamedTuple):
    """The PDU link can take a burst that leaves at `earliest` or later.

    `airtime_s(mcs, n_pdus)` is a burst's length; `most_pdus(mcs, airtime_s)` how many PDUs fit, 0
    when not even one does; the PDU link's own limit is heeded. What begins at `start` is no longer
    than `made_by(start)`, or one PDU: a longer burst would not be there in time. None: any length
    is.
    """

    earliest: float
    airtime_s: Callable[[int, int], float]
    most_pdus: Callable[[int, float], int]
    sensed: Sensed = Sensed()
    made_by: Callable[[float], float] | None = None
