"""Decides how long the next burst may be, and whether it should wait.

This package holds the forecasts of messages that are due, the caps and shares of the classes and
their credit, budgets of airtime, and the flows of the team that air is reserved for. It knows
neither queue nor radio; their state is passed in as arguments.
"""

from sdrlinkd.link.schedule.admitted import Claim, admitted, planner_of, way_of
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
    AdmissionParams,
    BulkParams,
    ClassesParams,
    ClassParams,
    DefaultParams,
    LatencyParams,
    UrgentParams,
)
from sdrlinkd.link.schedule.shares import Shares
from sdrlinkd.link.schedule.team_air import TeamAir, TeamFlow, ToldOfAir

__all__ = [
    "IDLE_SHARE",
    "OVERRUN",
    "SHARED_OVERRUN",
    "AdmissionParams",
    "Allowance",
    "Budget",
    "BulkParams",
    "Claim",
    "ClassParams",
    "ClassesParams",
    "DefaultParams",
    "Flow",
    "Forecasts",
    "LatencyParams",
    "Limits",
    "Shares",
    "TeamAir",
    "TeamFlow",
    "ToldOfAir",
    "UrgentParams",
    "admitted",
    "planner_of",
    "way_of",
]
