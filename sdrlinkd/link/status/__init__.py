"""What a person is told: rates over the last minutes, and why a topic fares as it does.

This room owns the memory of where counters stood. It counts nothing itself, and decides nothing.
"""

from sdrlinkd.link.status.meters import RateMeter
from sdrlinkd.link.status.why import AirUse, Told, Why

__all__ = [
    "AirUse",
    "RateMeter",
    "Told",
    "Why",
]
