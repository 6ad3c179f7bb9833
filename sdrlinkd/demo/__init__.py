"""The paper's experiment with real daemons: send a robot's messages across, see what arrives."""

from sdrlinkd.demo.links import LINKS, Options
from sdrlinkd.demo.report import DemoReport, RunResult
from sdrlinkd.demo.run import run_demo
from sdrlinkd.demo.source import Source, open_source
from sdrlinkd.demo.table import table_6, topic_table
from sdrlinkd.demo.trace import Trace

__all__ = [
    "LINKS",
    "DemoReport",
    "Options",
    "RunResult",
    "Source",
    "Trace",
    "open_source",
    "run_demo",
    "table_6",
    "topic_table",
]
