"""How long the next burst may be, and whether it had better wait."""

from sdrlinkd.link.schedule.allowance import OVERRUN, SHARED_OVERRUN, Allowance, Limits
from sdrlinkd.link.schedule.forecast import Forecasts
from sdrlinkd.link.schedule.params import ClassesParams, ClassParams
from sdrlinkd.link.schedule.shares import Shares

__all__ = [
    "OVERRUN",
    "SHARED_OVERRUN",
    "Allowance",
    "ClassParams",
    "ClassesParams",
    "Forecasts",
    "Limits",
    "Shares",
]
