"""Starts both ends of a peer, one in each namespace, and collects what they heard."""

import json
import time
from collections.abc import Callable
from contextlib import ExitStack
from typing import NamedTuple

from benchmarks.absent import PeerError
from benchmarks.environments import interpreter, variables
from benchmarks.peers.pound.job import CONTACT_S, Job, Loop, Topic
from benchmarks.peers.pound.namespaces import Network, Node
from benchmarks.peers.pound.table import PEERS, unavailable
from sdrlinkd.process import Process

START_S = 0.3
"""Time from when both ends are ready to the start of the experiment."""
LATE_S = 30.0
"""An end that has not reported this long after its time hangs."""


class Told(NamedTuple):
    """The report of one end."""

    heard: dict[int, dict[int, float]]
    """Arrival time of each topic's messages by number: s after the start."""
    values: list[float]
    """The plant's output at each tick."""


class Plan(NamedTuple):
    """The task of a pair of ends; see `Job`."""

    topics: list[Topic]
    sends: dict[str, list[tuple[float, int, int]]]
    """Each side's schedule."""
    seconds: float
    loop: Loop | None = None


def run_ends(
    peer: str, plan: Plan, network: Network, during: Callable[[float], None] | None = None
) -> dict[str, Told]:
    """Run sides "a" and "b", and return their reports.

    `during` is called with the start, in monotonic s. Raises PeerError and ProcessError.
    """
    if (reason := unavailable(peer)) is not None:
        raise PeerError(f"{peer}: {reason}")
    with ExitStack() as stack:
        ends = {}
        for side, here, there in (("a", network.a, network.b), ("b", network.b, network.a)):
            job = Job(
                peer,
                side,
                here.address,
                there.address,
                network.rate_bps / network.hops,
                plan.topics,
                plan.sends.get(side, []),
                plan.seconds,
                plan.loop,
            )
            ends[side] = _start(stack, job, here)
        for end in ends.values():
            if (line := end.line(2 * CONTACT_S + LATE_S)) != "ready":
                raise PeerError(f"{end.name}: {json.loads(line)['error']}")
        start = time.monotonic() + START_S
        for end in ends.values():
            end.tell(repr(start))
        if during:
            during(start)
        # Reading lines meanwhile would take CPU time from the measured programs.
        time.sleep(max(0.0, start + plan.seconds - time.monotonic()))
        return {side: _told(end.line(LATE_S)) for side, end in ends.items()}


def _start(stack: ExitStack, job: Job, node: Node) -> Process:
    """Start one end with its job. It ends by itself in bounded time, or with the stack."""
    program = [interpreter(PEERS[job.peer].environment), "-m", "benchmarks.peers.pound.endpoint"]
    name = f"{job.peer}, end {job.side}"
    command = node.command(*program)
    end = Process(command, name=name, environment=variables(), session=False)
    stack.callback(end.kill)
    end.start()
    end.tell(job.to_json())
    return end


def _told(line: str) -> Told:
    told = json.loads(line)
    heard = {int(topic): dict(pairs) for topic, pairs in told["heard"].items()}
    return Told(heard, told["values"])
