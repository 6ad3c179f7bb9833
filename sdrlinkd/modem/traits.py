"""Derives the PDU link's traits from a radio and the modem's settings."""

import math

import phy
from backends import GAP, Capabilities, TxWindows
from sdrlinkd.config import ModemParams
from sdrlinkd.link import PduLinkTraits
from sdrlinkd.modem.airtimes import Airtimes

HANDOVER_S = 2.5e-4
"""Time in s from composing a burst to its start on a free channel, for modulation. A burst that
takes much longer starts later, and tells its ages for that."""
STAMP_SAMPLES = 1.0
"""Largest error of a detected preamble's position, in samples."""
REACTION_S = 0.002
"""Time in s from the last sample of a block to a decision that follows from it."""


def pdu_link_traits(
    kind: str, can: Capabilities, params: ModemParams, airtimes: Airtimes
) -> PduLinkTraits:
    """The traits of a modem with these parameters, on a radio with the capabilities `can`.

    In lock-step, composing takes no time but happens only once per block.
    """
    follow_s, pause_s, longest_s = can.tx_windows or TxWindows(0.0, 0.0, math.inf)
    return PduLinkTraits(
        kind=kind,
        is_lockstep=can.lockstep,
        transmits=can.transmits,
        senses=can.receives,
        shares_air=can.shares_air,
        turnaround_s=can.turnaround_s,
        index_error_s=can.index_error_s,
        stamp_s=STAMP_SAMPLES / params.rate_hz + can.index_error_s,
        lead_s=can.lead_s + can.turnaround_s + (HANDOVER_S if can.paced else 0.0),
        react_s=can.block_s + (REACTION_S if can.paced else 0.0),
        # A burst that starts within one window may be detected only in the next one.
        detect_s=2 * phy.SENSE_WINDOW / params.rate_hz,
        overhead_s=airtimes.overhead_s,
        gap_s=GAP / params.rate_hz,
        tx_window_s=longest_s,
        tx_window_follow_s=follow_s,
        rx_window_s=pause_s,
        ahead_s=can.block_s if can.lockstep else params.tx_lead_s,
        longest_burst_s=airtimes.longest_s(),
        pdu_burst_s=airtimes.shortest_s(),
        mcs=params.mcs,
        needed_snr_db=airtimes.needed_snr_db(),
        slower=phy.SLOWER_MCS,
        pulse_s=phy.N_PULSE / params.rate_hz,
    )
