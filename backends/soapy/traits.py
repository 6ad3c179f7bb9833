"""What a device's nature makes of its settings."""

from typing import NamedTuple

from backends.base import Spells

HANDOVER_S = 0.01
"""Before a transfer begins to leave, all of it must have been with the driver for so long."""
MARGIN_S = 0.02
"""From the daemon to the radio process, on a busy machine."""


class TxTraits(NamedTuple):
    """How bursts leave a device, in s; `transfer_s` is the length of what it moves at once.

    Where samples are counted, bursts leave behind `leading` transfers of zeros, in whole transfers,
    and TRAILING of zeros come after them, for what is cut off at the end. A transfer is taken from
    the driver when those `in_flight` before it have still to leave.
    """

    lead_s: float
    turnaround_s: float
    spells: Spells | None


TRAILING = 2
"""Transfers of zeros after the last burst."""
IN_FLIGHT = {"hackrf": 4}
"""Transfers that a driver takes ahead of the antenna."""


def keeps_time(has_time: bool, full_duplex: bool) -> bool:
    """Whether bursts leave at times that the device itself keeps; else samples are counted."""
    return has_time and full_duplex


def tx_traits(
    has_time: bool, full_duplex: bool, transfer_s: float, in_flight: int, leading: int,
    lead_s: float, turnaround_s: float, listen_s: float, longest_s: float,
) -> TxTraits:  # fmt: skip
    """Of a device, and what it is set to."""
    if keeps_time(has_time, full_duplex):
        return TxTraits(lead_s, 0.0, None)
    handover_s = (1 + in_flight) * transfer_s + HANDOVER_S
    if full_duplex:
        return TxTraits(handover_s + leading * transfer_s + MARGIN_S, 0.0, None)
    # Before the first sample, and after the last.
    deaf_s = turnaround_s + (1 + leading) * transfer_s
    spells = Spells(
        follow_s=handover_s + MARGIN_S,
        pause_s=turnaround_s
        + (1 + TRAILING) * transfer_s
        + listen_s
        + deaf_s
        + handover_s
        + MARGIN_S,
        longest_s=longest_s,
    )
    return TxTraits(handover_s + MARGIN_S, deaf_s, spells)
