"""What tests look at, piece by piece; not part of the interface."""

from sdrlinkd.link.transmit.motion import STALE_S, WEIGHT, Motion, longest_burst_s

__all__ = ["STALE_S", "WEIGHT", "Motion", "longest_burst_s"]
