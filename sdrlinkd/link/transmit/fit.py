"""What follows from the radio that is there: the access policy, the MCS in use, and its times."""

from random import Random
from typing import NamedTuple

from sdrlinkd.link.access import AccessParams, Settled, settle
from sdrlinkd.link.traits import PduLinkTraits
from sdrlinkd.link.transmit.rate import RateControl, RateParams

NOTICE_S = 5e-4
"""From a producer's clock to our queue, in real time."""


class Fit(NamedTuple):
    """How the link uses one radio; times in s."""

    settled: Settled
    """The access policy in force, and why."""
    rate: RateControl
    lead_s: float
    """A burst decided now leaves so much later at the earliest."""
    least_s: float
    """No message can be younger when it arrives."""
    record_pdu_s: float
    """What a PDU with nothing but records takes of the air."""
    notice_s: float
    """So long after a message has been made, nobody here knows of it."""
    stamp_s: float
    """How wrong the times may be at which bursts left and came."""
    is_lockstep: bool
    """The link's time begins when the radio is there."""


def fit_to(
    traits: PduLinkTraits, access: AccessParams, rate: RateParams, own_id: int, rng: Random
) -> Fit:
    """Settle access and rate for the radio that is there. Raises ConfigError."""
    control = RateControl(rate, traits.needed_snr_db, traits.mcs)
    longest_s = traits.longest_in_use_s(control.usable)
    settled = settle(access, own_id, traits, longest_s, rng)
    lengths_s = [
        length_s for mcs, length_s in enumerate(traits.pdu_burst_s) if mcs in control.usable
    ]
    return Fit(
        settled,
        control,
        traits.lead_s,
        traits.lead_s + min(lengths_s, default=0.0),
        # A burst on its own makes a half-duplex radio deaf for much longer than it lasts.
        max(lengths_s, default=0.0) + 2 * traits.turnaround_s,
        traits.ahead_s if traits.is_lockstep else NOTICE_S,
        traits.stamp_s,
        traits.is_lockstep,
    )
