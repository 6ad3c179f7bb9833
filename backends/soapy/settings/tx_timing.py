"""Timing of bursts on a device, computed from its properties and its settings."""

from typing import NamedTuple, Protocol

from backends.base import TxWindows

HANDOVER_S = 0.01
"""How long a transfer must be complete in the driver before it begins to leave."""
MARGIN_S = 0.02
"""Delay from the daemon to the radio process on a busy machine."""
TRAILING = 2
"""Number of transfers of zeros after the last burst."""


class TxHardware(Protocol):
    """The properties of a device that decide how it sends bursts."""

    @property
    def has_time(self) -> bool:
        """Whether the device stamps its samples by its own clock."""

    @property
    def full_duplex(self) -> bool:
        """Whether the device receives while it sends."""

    @property
    def tx_transfer_s(self) -> float:
        """Length in s of a transfer: what the driver moves at once when it sends."""

    @property
    def in_flight(self) -> int:
        """Number of transfers that the driver accepts ahead of the antenna."""


class TxTiming(NamedTuple):
    """Lead that bursts need, and turnaround and TX windows of a half-duplex device; in s.

    If samples are counted, everything is sent in whole transfers. `leading` transfers of zeros
    precede the bursts, and TRAILING ones follow them, because the end may be cut off. The device
    takes a transfer from the driver while the `in_flight` transfers before it have yet to leave.
    """

    lead_s: float
    turnaround_s: float
    tx_windows: TxWindows | None


def timestamped_tx(has_time: bool, full_duplex: bool) -> bool:
    """Whether the device sends bursts at given times; otherwise samples are counted."""
    return has_time and full_duplex


def timing_of(
    hardware: TxHardware, leading: int, lead_s: float, turnaround_s: float, listen_s: float,
    longest_s: float,
) -> TxTiming:  # fmt: skip
    """The timing of a device, from its properties and its settings; `leading` in transfers."""
    transfer_s = hardware.tx_transfer_s
    if timestamped_tx(hardware.has_time, hardware.full_duplex):
        return TxTiming(lead_s, 0.0, None)
    handover_s = (1 + hardware.in_flight) * transfer_s + HANDOVER_S
    if hardware.full_duplex:
        return TxTiming(handover_s + leading * transfer_s + MARGIN_S, 0.0, None)
    # Turnaround plus the transfers of zeros before the first sample, or after the last.
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
