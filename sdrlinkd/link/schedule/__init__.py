"""Decides how long the next burst may be, and whether it should wait.

This package holds the forecasts of messages that are due, the caps and shares of the classes and
their credit, and budgets of airtime. It knows neither queue nor radio; their state is passed in as
arguments.
"""

from sdrlinkd.link.schedule.allowance import (
    IDLE_SHARE,
    OVERRUN,
    SHARED_OVERRUN,
    Allowance,
    Limits,
)
from sdrlinkd.link.schedule.budget import Budget
from sdrlinkd.link.schedule.forecast import Flow, Forecasts
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
    "Budget",
    "BulkParams",
    "ClassParams",
    "ClassesParams",
    "DefaultParams",
    "Flow",
    "Forecasts",
    "LatencyParams",
    "Limits",
    "Shares",
    "UrgentParams",
]
