"""Many robots on one simulated air: scenarios, their hub, and a run with real daemons."""

from sdrlinkd.lab.hub import make_hub
from sdrlinkd.lab.report import LabReport, PairResult, RobotResult
from sdrlinkd.lab.run import LabOptions, LabState, run_lab
from sdrlinkd.lab.scenario import Scenario, load_scenario
from sdrlinkd.lab.shipped import find_scenario, shipped_scenarios
from sdrlinkd.lab.table import live_table, pair_table

__all__ = [
    "LabOptions",
    "LabReport",
    "LabState",
    "PairResult",
    "RobotResult",
    "Scenario",
    "find_scenario",
    "live_table",
    "load_scenario",
    "make_hub",
    "pair_table",
    "run_lab",
    "shipped_scenarios",
]
