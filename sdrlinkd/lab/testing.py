"""What tests look at, piece by piece; not part of the interface."""

from sdrlinkd.lab.over_time import BINS, ClassOverTime, Clock, classes_over_time
from sdrlinkd.lab.report import pair_result, robot_result
from sdrlinkd.lab.robots import open_sources, write_daemon_config
from sdrlinkd.lab.scenario import outages_of
from sdrlinkd.lab.traces import read_outages
from sdrlinkd.lab.traffic import Listener

__all__ = [
    "BINS",
    "ClassOverTime",
    "Clock",
    "Listener",
    "classes_over_time",
    "open_sources",
    "outages_of",
    "pair_result",
    "read_outages",
    "robot_result",
    "write_daemon_config",
]
