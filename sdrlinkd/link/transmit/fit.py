"""Fits the link to a radio: access policy, rate control, and times."""

from math import ceil
from random import Random
from typing import NamedTuple

from sdrlinkd.link.access import AccessParams, Settled, settle
from sdrlinkd.link.traits import PduLinkTraits
from sdrlinkd.link.transmit.rate import RateControl, RateParams

NOTICE_S = 5e-4
"""Time in s from a message's publication to our queue, in real time."""


class Fit(NamedTuple):
    """How the link uses one radio; times are in s."""

    settled: Settled
    """The access policy in force, and why."""
    rate: RateControl
    lead_s: float
    """Shortest time from a decision until the burst leaves."""
    least_s: float
    """Smallest possible age of a message at its arrival."""
    record_pdu_s: float
    """Airtime lost to a PDU that holds only records, including turnarounds."""
    notice_s: float
    """Longest time from a message's publication until this node knows of it."""
    stamp_s: float
    """Largest error of the times at which bursts left and came."""
    slower: tuple[int, ...]
    """By MCS, that with which its PDUs are repeated."""
    pulse_s: float
    """Length of a pulse of energy."""
    is_lockstep: bool
    """Whether the radio runs in lock-step; the link's time then starts with the radio."""
    pdu_burst_s: tuple[float, ...] = (0.0,)
    """Length of a burst with one PDU, by MCS."""
    longest_burst_s: tuple[float, ...] = (0.0,)
    """Length of the longest burst, by MCS."""
    overhead_s: float = 0.0
    """Time that a burst takes in addition to its PDUs."""
    gap_s: float = 0.0
    """Time that stays free between two bursts."""

    @property
    def most_s(self) -> float:
        """Length of the longest burst of several PDUs; 0 if all bursts have one."""
        lengths = zip(self.longest_burst_s, self.pdu_burst_s, strict=False)
        several = [longest for mcs, (longest, one) in enumerate(lengths)
                   if longest > one and mcs in self.rate.usable]  # fmt: skip
        return max(several, default=0.0)

    def message_s(self, mcs: int, n_pdus: int) -> float:
        """Airtime in s of a message of so many PDUs, which goes in bursts of its own."""
        each_s = max(0.0, self.pdu_burst_s[mcs] - self.overhead_s)
        room_s = max(self.longest_burst_s[mcs] - self.overhead_s, each_s)
        most = max(1, int(room_s / each_s)) if each_s else n_pdus
        return n_pdus * each_s + ceil(n_pdus / most) * (self.overhead_s + self.gap_s)


def fit_to(
    traits: PduLinkTraits, access: AccessParams, rate: RateParams, own_id: int, rng: Random,
    room: int,
) -> Fit:  # fmt: skip
    """Choose access policy and rate control for a radio with these traits. Raises ConfigError.

    `room` is the number of octets for records in a PDU.
    """
    control = RateControl(rate, traits.needed_snr_db, traits.mcs)
    longest_s = traits.longest_in_use_s(control.usable)
    lengths_s = tuple(
        length_s for mcs, length_s in enumerate(traits.pdu_burst_s) if mcs in control.usable
    )
    settled = settle(access, own_id, traits._replace(pdu_burst_s=lengths_s), longest_s, rng, room)
    return Fit(
        settled,
        control,
        traits.lead_s,
        traits.lead_s + min(lengths_s, default=0.0),
        # A single burst makes a half-duplex radio deaf for much longer than its own length.
        max(lengths_s, default=0.0) + 2 * traits.turnaround_s,
        traits.ahead_s if traits.is_lockstep else NOTICE_S,
        traits.stamp_s,
        traits.slower,
        traits.pulse_s,
        traits.is_lockstep,
        traits.pdu_burst_s,
        traits.longest_burst_s,
        traits.overhead_s,
        traits.gap_s,
    )
