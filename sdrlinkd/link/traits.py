"""What the link must know about its PDU link."""

from collections.abc import Callable, Collection
from math import inf
from typing import NamedTuple


class PduLinkTraits(NamedTuple):
    """The traits of a PDU link for access policies and rate control; times are in s.

    `lead_s` is the shortest time from a decision until the burst leaves. `react_s` is the time from
    a sample on the air until a decision can follow from it. `detect_s` is the shortest length of a
    burst that is detected. `gap_s` stays free between two bursts of one node. `needed_snr_db`,
    `longest_burst_s` and `pdu_burst_s` (the length of a burst with one PDU) are tuples by MCS.
    """

    kind: str = "direct"
    is_lockstep: bool = False
    """Whether it runs in lock-step: time is that of the samples and waits for all nodes."""
    transmits: bool = True
    senses: bool = False
    shares_air: bool = False
    """Whether other robots may use the same channel."""
    turnaround_s: float = 0.0
    index_error_s: float = 0.0
    """Largest error of times after a gap in the samples."""
    lead_s: float = 0.0
    react_s: float = 0.0
    detect_s: float = 0.0
    overhead_s: float = 0.0
    """Time that a burst takes in addition to its PDUs."""
    gap_s: float = 0.0
    tx_window_s: float = inf
    """Longest TX window, in which the radio sends without listening."""
    tx_window_follow_s: float = 0.0
    """Shortest time before the end of a burst at which the next one must be decided to follow in
    the same TX window."""
    rx_window_s: float = 0.0
    """Time for which the radio listens between two TX windows."""
    ahead_s: float = 0.0
    """Time by which a burst at a fixed time may be decided earlier than necessary."""
    longest_burst_s: tuple[float, ...] = (0.0,)
    """Length of the longest burst, by MCS."""
    pdu_burst_s: tuple[float, ...] = (0.0,)
    mcs: int = 0
    """The configured MCS, used without rate control."""
    needed_snr_db: tuple[float, ...] = (0.0,)
    slower: tuple[int, ...] = ()
    """By MCS, the one with the same code rate and the next lower modulation, or itself; without an
    entry: itself."""
    pulse_s: float = 0.0
    """Length of a pulse of energy that others detect; 0: the radio sends none."""
    stamp_s: float = 2e-4
    """Largest error of the times at which bursts left and came."""

    def longest_in_use_s(self, usable: Collection[int]) -> float:
        """Length of the longest burst of the MCS in `usable`, in s."""
        return max(self.longest_burst_s[mcs] for mcs in usable)


class Sensed(NamedTuple):
    """The receiver's view of the channel, up to `until`.

    The channel has been idle since `idle_since`; while it is busy, that is later than `until`.
    `burst_at` is the time of the last burst's preamble, None if only energy was detected. Energy
    that lasts no longer than a pulse may be one: `carrier_end` and `carrier_at` are end and
    preamble of what was longer, and `pulses` tells when the pulses after that began.
    """

    until: float = inf
    idle_since: float = 0.0
    burst_at: float | None = None
    carrier_end: float = 0.0
    carrier_at: float | None = None
    pulses: tuple[float, ...] = ()


class Opportunity(NamedTuple):
    """An opportunity to send: the PDU link can take a burst that leaves at `earliest` or later.

    `airtime_s(mcs, n_pdus)` is the length of a burst in s. `most_pdus(mcs, airtime_s)` is how many
    PDUs fit within the PDU link's own limit, 0 if none does. A burst at `start` must not be longer
    than `made_by(start)` or one PDU, as a longer one would not be modulated in time; None: no such
    limit.
    """

    earliest: float
    airtime_s: Callable[[int, int], float]
    most_pdus: Callable[[int, float], int]
    sensed: Sensed = Sensed()
    made_by: Callable[[float], float] | None = None
