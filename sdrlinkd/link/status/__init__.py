"""What a person is told: rates over the last minutes, and why a topic fares as it does."""

from sdrlinkd.link.status.meters import RateMeter, rate_counters
from sdrlinkd.link.status.why import Told, Why

__all__ = [
    "RateMeter",
    "Told",
    "Why",
    "rate_counters",
]
