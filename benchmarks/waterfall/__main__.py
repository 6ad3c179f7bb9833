"""Where a message's time goes: odometry at 30 Hz through a daemon that hears itself.

One message is on its way at a time, so the stages that are noted between its sending and its
arrival are its own.
"""

import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np

from benchmarks import daemons
from benchmarks.realtime.alone import ODOM, ODOM_S, ODOM_SIZE
from benchmarks.realtime.traffic import flow, play
from benchmarks.report import Row, main

HOOKS = Path(__file__).parent / "hooks"
SECONDS, QUICK_S = 20.0, 3.0
ENDS = (
    "sent", "submit", "accepted", "compose", "composed", "ordered", "modulated", "begins", "ends",
    "block", "received", "told", "publish", "arrived",
)  # fmt: skip
"""What ends one stage and begins the next, in the order in which a message passes."""
STAGES: dict[str, tuple[str, float]] = {
    "to_daemon": ("from the producer over ZeroMQ to the link", 463),
    "accept": ("the link takes it into its queue", 132),
    "to_compose": ("the event loop turns to the radio", 174),
    "compose": ("the link composes a burst", 314),
    "to_modem": ("the order reaches the modem", 0),
    "modulate": ("the modem modulates the burst", 349),
    "lead": ("the burst waits for its start", -307),
    "air": ("the burst is on the air", 2854),
    "to_block": ("the block with its last sample is made, with its noise", 596),
    "receive": ("the receiver decodes the PDU", 489),
    "to_link": ("the PDU reaches the daemon", 73),
    "hear": ("the link unpacks the message", 448),
    "to_consumer": ("over ZeroMQ to the consumer", 435),
}
"""Name of each stage, what happens in it, and how long it took in µs before there was a modem
process, measured once in the same way: then modem and daemon were threads of one interpreter."""
ALL_BEFORE = 6757.0


def measure(seed: int, quick: bool) -> Iterator[Row]:
    """One row for each stage, and one for the whole way."""
    stages = _stages(seed, QUICK_S if quick else SECONDS)
    n = len(stages["all"])
    for name, (what, before) in STAGES.items():
        yield _row(f"{name}_us", stages[name], before, what)
    note = f"{n} messages of {ODOM_SIZE} B, QPSK 1/2 at 5 Msps; stamping is included"
    yield _row("all_us", stages["all"], ALL_BEFORE, note)


def _row(name: str, taken_us: list[float], before: float, note: str) -> Row:
    p50, p99 = np.quantile(taken_us, [0.5, 0.99])
    peers = {"p99": float(p99), "before": before}
    return Row(name, float(p50), "µs", None, "less", len(taken_us), peers, note=note)


def _stages(seed: int, seconds: float) -> dict[str, list[float]]:
    """The time in µs that each message spent in each stage, and on the whole way."""
    wanted = [flow("odom", ODOM_SIZE, ODOM_S, seconds)]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "stages"
        hooks = {"WATERFALL": str(file), "PYTHONPATH": str(HOOKS)}
        with daemons.running("loopback", (1,), ("odom",), ODOM, "", hooks=hooks) as these:
            record = play(these.folders[1], these.folders[1], wanted, seed)["odom"]
            apart_ns = time.time_ns() - time.monotonic_ns()
        notes: dict[str, list[int]] = defaultdict(list)
        for line in file.read_text().splitlines():
            stage, at_ns = line.split()
            notes[stage].append(int(at_ns))
    found: dict[str, list[float]] = defaultdict(list)
    ordered = {stage: np.sort(each) for stage, each in notes.items()}
    for head, sent in record.sent.items():
        if head not in record.heard:
            continue
        way = _way(ordered, sent - apart_ns, record.heard[head] - apart_ns)
        if way is None:
            continue
        for name, (began, ended) in zip(STAGES, pairwise(way), strict=True):
            found[name].append(1e-3 * (ended - began))
        found["all"].append(1e-3 * (way[-1] - way[0]))
    return found


def _way(
    notes: dict[str, "np.typing.NDArray[np.int64]"], sent_ns: int, arrived_ns: int
) -> list[int] | None:
    """When a message passed each of ENDS; None if another burst, as a beacon, was on the way."""
    way = [sent_ns]
    for stage in ENDS[1:-1]:
        each = notes.get(stage, np.zeros(0, np.int64))
        low, high = np.searchsorted(each, [sent_ns, arrived_ns])
        if high - low != 1:
            return None
        way.append(int(each[low]))
    return [*way, arrived_ns]


if __name__ == "__main__":
    sys.exit(main("waterfall", measure))
