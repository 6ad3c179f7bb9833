"""What a device's nature makes of its settings."""


def keeps_time(has_time: bool, full_duplex: bool) -> bool:
    """Whether bursts leave at times that the device itself keeps; else samples are counted."""
    return has_time and full_duplex


def lead_s(keeps_its_time: bool, wished_s: float, transfer_s: float, leading: int) -> float:
    """How long before its start a burst must be handed over.

    Where samples are counted, the first one leaves behind `leading` transfers of zeros, and a
    transfer must be whole before it leaves.
    """
    return wished_s if keeps_its_time else (2 + leading) * transfer_s
