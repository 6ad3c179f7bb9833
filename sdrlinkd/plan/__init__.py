"""Predicts whether traffic fits the channel, before anything is sent."""

from sdrlinkd.plan.air import Setting
from sdrlinkd.plan.bounds import AccessBound, access_bounds
from sdrlinkd.plan.model import ClassPlan, Plan, TopicPlan, make_plan
from sdrlinkd.plan.response import Worst
from sdrlinkd.plan.setting import HOST_S, MOST_ROBOTS, bounds_of, setting_of
from sdrlinkd.plan.team import team_worst_s
from sdrlinkd.plan.traffic import (
    LeftOut,
    Load,
    loads_from_bag,
    names_in,
    parse_load,
    with_declared,
)

__all__ = [
    "HOST_S",
    "MOST_ROBOTS",
    "AccessBound",
    "ClassPlan",
    "LeftOut",
    "Load",
    "Plan",
    "Setting",
    "TopicPlan",
    "Worst",
    "access_bounds",
    "bounds_of",
    "loads_from_bag",
    "make_plan",
    "names_in",
    "parse_load",
    "setting_of",
    "team_worst_s",
    "with_declared",
]
