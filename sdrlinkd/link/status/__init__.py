"""Status for people: recent rates, and explanations of what happens to a topic.

This package keeps samples of counters. It counts nothing itself and takes no decisions.
"""

from sdrlinkd.link.status.meters import RateMeter
from sdrlinkd.link.status.reserved import (
    admission_report,
    refused_notices,
    reserved_words,
)
from sdrlinkd.link.status.why import AirUse, Told, Why

__all__ = [
    "AirUse",
    "RateMeter",
    "Told",
    "Why",
    "admission_report",
    "refused_notices",
    "reserved_words",
]
