"""The paper's experiment with real daemons: sends a robot's messages and measures what arrives."""

from sdrlinkd.demo.folder import run_folder
from sdrlinkd.demo.hearing import Hearing
from sdrlinkd.demo.links import NODE_ID, Options, write_config
from sdrlinkd.demo.nodes import daemon_process, problems_of, snapshot_of, wait_until_up
from sdrlinkd.demo.rate import Found, find_rate
from sdrlinkd.demo.report import DemoReport, RunResult, TopicResult, latency_ms
from sdrlinkd.demo.run import run_demo
from sdrlinkd.demo.source import Source, open_source
from sdrlinkd.demo.table import PAPER_TABLE_6, table_6, topic_table
from sdrlinkd.demo.trace import Pair, Sample, Trace
from sdrlinkd.demo.verdict import is_good, verdict

__all__ = [
    "NODE_ID",
    "PAPER_TABLE_6",
    "DemoReport",
    "Found",
    "Hearing",
    "Options",
    "Pair",
    "RunResult",
    "Sample",
    "Source",
    "TopicResult",
    "Trace",
    "daemon_process",
    "find_rate",
    "is_good",
    "latency_ms",
    "open_source",
    "problems_of",
    "run_demo",
    "run_folder",
    "snapshot_of",
    "table_6",
    "topic_table",
    "verdict",
    "wait_until_up",
    "write_config",
]
