"""Whether traffic fits the air, before anything is sent."""

from sdrlinkd.plan.model import ClassPlan, Plan, Setting, TopicPlan, make_plan
from sdrlinkd.plan.setting import setting_of
from sdrlinkd.plan.traffic import Load, loads_from_bag, parse_load

__all__ = [
    "ClassPlan",
    "Load",
    "Plan",
    "Setting",
    "TopicPlan",
    "loads_from_bag",
    "make_plan",
    "parse_load",
    "setting_of",
]
