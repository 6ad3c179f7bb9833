"""Runs the receiver of a checkout in a process of its own: CPU time for one burst of 64 B."""

import json
from pathlib import Path

from benchmarks.environments import interpreter
from benchmarks.processes import told_by
from benchmarks.realtime import burst
from benchmarks.realtime.turns import Run

BURSTS, QUICK_BURSTS = 300, 60
RUN = "import runpy; runpy.run_path({path!r})['main']()"
"""Runs this checkout's program although `phy`, and so `benchmarks`, is that of another one."""


def one_burst(tree: Path, seed: int, quick: bool) -> Run:
    """CPU time when burst follows burst, and when each comes after 20 ms of sleep."""
    n = QUICK_BURSTS if quick else BURSTS
    told = told_by(
        "receiver", interpreter(""), "-c", RUN.format(path=burst.__file__), n, seed, tree=tree
    )
    took_us = json.loads(told)
    values = {
        "rx_us_64B_burst_hot": took_us["hot"], "rx_us_64B_burst_asleep_20ms": took_us["asleep"]
    }  # fmt: skip
    return Run(values, n, "medians of the receiver thread's CPU time, QPSK 1/2")
