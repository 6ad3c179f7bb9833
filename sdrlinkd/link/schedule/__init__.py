"""How long the next burst may be, and whether it had better wait.

This room owns the forecasts of what is due, the classes' caps and shares, and their credit. It
knows no queue and no radio: what waits and what the air takes are arguments.
"""

from sdrlinkd.link.schedule.allowance import (
    IDLE_SHARE,
    OVERRUN,
    SHARED_OVERRUN,
    Allowance,
    Limits,
)
from sdrlinkd.link.schedule.forecast import Forecasts
from sdrlinkd.link.schedule.params import (
    BulkParams,
    ClassesParams,
    ClassParams,
    DefaultParams,
    LatencyParams,
    UrgentParams,
)
from sdrlinkd.link.schedule.shares import Shares

__all__ = [
    "IDLE_SHARE",
    "OVERRUN",
    "SHARED_OVERRUN",
    "Allowance",
    "BulkParams",
    "ClassParams",
    "ClassesParams",
    "DefaultParams",
    "Forecasts",
    "LatencyParams",
    "Limits",
    "Shares",
    "UrgentParams",
]
