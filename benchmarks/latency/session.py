"""One session: VIO odometry to the FCU and IMU back, at the same time, between two clocks."""

import json
import time
from contextlib import ExitStack
from typing import NamedTuple

import numpy as np

from benchmarks.absent import PeerError
from benchmarks.latency.correction import Direction, Seconds, Stamps, direction
from benchmarks.peers.latency.clock import Clock
from benchmarks.peers.latency.job import MOST_TOPICS, STAMP, Job
from benchmarks.peers.latency.table import PEERS, unavailable
from benchmarks.peers.latency.way import Way
from benchmarks.processes import busy_cores, precede, start_module, usage
from sdrlinkd.process import Process

START_S = 0.3
"""Time from when both ends are ready to the start."""
WARMUP_S = 6.5
"""At 100 requests per second: more than the 500 samples that the paper's filter needs."""
CLOCKS = {"companion": Clock(0.0, 0.0), "fcu": Clock(3.7, 20.0)}


class Session(NamedTuple):
    """The outcome of one session."""

    forward: Direction
    """Companion computer to FCU."""
    backward: Direction
    """FCU to companion computer."""
    cpu_share: dict[str, float]
    """Load by process after the warm-up, as a share of one core."""
    rss_mib: dict[str, float]
    """Memory by process, at the end."""
    filter_error_s: Seconds
    """Errors of both ends' filters, concatenated."""
    line_late_s: Seconds
    """Delay of each piece on the emulated line beyond its due time; empty without a line."""


def run(
    transport_name: str,
    *,
    seconds: float,
    rate_hz: float = 200.0,
    size: int = 115,
    n_topics: int = 1,
    stress: bool = False,
    seed: int = 1,
    warmup_s: float = WARMUP_S,
) -> Session:
    """Measure a peer for `seconds` after the warm-up. Raises PeerError and ProcessError."""
    if (reason := unavailable(transport_name)) is not None:
        raise PeerError(f"{transport_name}: {reason}")
    if not 1 <= n_topics <= MOST_TOPICS or size <= STAMP.size:
        what = f"{n_topics} topics of {size} bytes"
        raise ValueError(f"{what}; 1 to {MOST_TOPICS} of more than {STAMP.size} bytes are possible")
    with ExitStack() as stack:
        way = stack.enter_context(PEERS[transport_name].open(size))
        jobs = {
            side: Job(
                side,
                end.address,
                CLOCKS[side],
                rate_hz,
                size,
                n_topics,
                warmup_s,
                seconds,
                seed,
            )
            for side, end in way.ends.items()
        }
        ends = {side: _start(stack, job, way) for side, job in jobs.items()}
        for end in ends.values():
            end.line()
        if stress:
            stack.enter_context(busy_cores())
        return _measure(way, jobs, ends)


def _start(stack: ExitStack, job: Job, way: Way) -> Process:
    environment = way.ends[job.side].environment
    module = "benchmarks.peers.latency.endpoint"
    end = start_module(stack, job.side, module, environment=environment)
    precede(end, real_time=job.side == "fcu")
    end.tell(job.to_json())
    return end


def _measure(way: Way, jobs: dict[str, Job], ends: dict[str, Process]) -> Session:
    companion, fcu = jobs["companion"], jobs["fcu"]
    processes = ends | {each.name: each for each in way.between}
    start = time.monotonic() + START_S
    for end in ends.values():
        end.tell(repr(start))
    _sleep_until(start + companion.warmup_s)
    before = {name: usage(each.pid) for name, each in processes.items()}
    _sleep_until(start + companion.warmup_s + companion.seconds)
    after = {name: usage(each.pid) for name, each in processes.items()}
    told = {side: _stamps(end.line()) for side, end in ends.items()}
    forward = direction(companion, fcu, told["fcu"])
    backward = direction(fcu, companion, told["companion"])
    return Session(
        forward,
        backward,
        {name: (after[name].cpu_s - before[name].cpu_s) / companion.seconds for name in processes},
        {name: taken.rss_mib for name, taken in after.items()},
        np.concatenate([forward.filter_error_s, backward.filter_error_s]),
        np.array(way.line_late_s()),
    )


def _stamps(line: str) -> Stamps:
    told = json.loads(line)
    heard = np.array(told["heard"], dtype=np.float64).reshape(-1, 4)
    exchanges = np.array(told["exchanges"], dtype=np.float64).reshape(-1, 4)
    return Stamps(heard, exchanges / 1e9)


def _sleep_until(at: float) -> None:
    time.sleep(max(0.0, at - time.monotonic()))
