"""How bursts leave a device: what its nature makes of its settings."""

from typing import NamedTuple, Protocol

from backends.base import TxWindows

HANDOVER_S = 0.01
"""Before a transfer begins to leave, all of it must have been with the driver for so long."""
MARGIN_S = 0.02
"""From the daemon to the radio process, on a busy machine."""
TRAILING = 2
"""Transfers of zeros after the last burst."""


class TxHardware(Protocol):
    """What matters of a device for how bursts leave it."""

    @property
    def has_time(self) -> bool:
        """Whether the device stamps its samples by its own clock."""

    @property
    def full_duplex(self) -> bool:
        """Whether it receives while it sends."""

    @property
    def tx_transfer_s(self) -> float:
        """Length in s of what the driver moves at once when it sends."""

    @property
    def in_flight(self) -> int:
        """Transfers that the driver takes ahead of the antenna."""


class TxTiming(NamedTuple):
    """How long bursts must be known before they leave, and how a half-duplex device turns; in s.

    Where samples are counted, bursts leave behind `leading` transfers of zeros, in whole transfers,
    and TRAILING of zeros come after them, for what is cut off at the end. A transfer is taken from
    the driver when those `in_flight` before it have still to leave.
    """

    lead_s: float
    turnaround_s: float
    tx_windows: TxWindows | None


def timestamped_tx(has_time: bool, full_duplex: bool) -> bool:
    """Whether bursts leave at times that the device itself keeps; else samples are counted."""
    return has_time and full_duplex


def timing_of(
    hardware: TxHardware, leading: int, lead_s: float, turnaround_s: float, listen_s: float,
    longest_s: float,
) -> TxTiming:  # fmt: skip
    """The timing of a device, from what it is and what it is set to; `leading` in transfers."""
    transfer_s = hardware.tx_transfer_s
    if timestamped_tx(hardware.has_time, hardware.full_duplex):
        return TxTiming(lead_s, 0.0, None)
    handover_s = (1 + hardware.in_flight) * transfer_s + HANDOVER_S
    if hardware.full_duplex:
        return TxTiming(handover_s + leading * transfer_s + MARGIN_S, 0.0, None)
    # Before the first sample, and after the last.
    deaf_s = turnaround_s + (1 + leading) * transfer_s
    tx_windows = TxWindows(
        follow_s=handover_s + MARGIN_S,
        pause_s=turnaround_s
        + (1 + TRAILING) * transfer_s
        + listen_s
        + deaf_s
        + handover_s
        + MARGIN_S,
        longest_s=longest_s,
    )
    return TxTiming(handover_s + MARGIN_S, deaf_s, tx_windows)
