"""RT-WMP in the Pound paper's experiments, and in a team on our air."""

from collections import Counter
from collections.abc import Iterable
from itertools import combinations
from random import Random
from typing import NamedTuple

import numpy as np

from benchmarks.flows import Flow, Times, Trace
from benchmarks.peers.pound.rtwmp import PAPER, Frame, Message, Network, Params, loop_bound
from benchmarks.pound.tables import EXACT, KB, LASER_S, flows
from benchmarks.team.teams import RATE_HZ, TURNAROUND_S

LINKS = {2: [(0, 1)], 3: [(0, 1), (1, 2)]}
"""The chains of Tables I to V, by their number of nodes."""
FITTED = PAPER._replace(host_s=0.8e-3)
"""Host time: the only fitted value, chosen so that Table II's images come as often as there."""
AS_PROGRAMMED = PAPER._replace(host_s=0.2e-3, returns=True)
"""The token returns to its beginner, as in the authors' program; fitted in the same way."""
PATIENT = FITTED._replace(ack_margin_s=0.1)
"""A node waits as long for an answer as in the authors' program."""
LATE_S = 0.3
NUMBERS = 1_000_000
URGENT, BULK = 100, 10

PREAMBLE_S = 512 / RATE_HZ
"""Preamble and header of one of our bursts."""
OUR_AIR = Params(frame_overhead_s=PREAMBLE_S, gap_s=TURNAROUND_S)
URGENT_OCTETS, BULK_OCTETS = 64, 4096
URGENT_PERIOD_S = 0.1

OUTAGE_S = 5.0


def tables(n_nodes: int, seed: int, quick: bool, params: Params, loss: float = 0) -> list[Trace]:
    """Laser and image as in Tables I and II (2 nodes), or III and IV (3 nodes).

    What has not come when the flows end is lost: the paper's MDR is the ratio of its periods.
    """
    sent = flows(n_nodes - 1, EXACT, seed, quick)
    rng = np.random.default_rng(seed)
    traces = [Trace(flow, flow.times(rng), np.full(flow.count, np.nan)) for flow in sent]

    def deliver(message: Message, now: float) -> None:
        which, number = divmod(message.number, NUMBERS)
        traces[which].heard_at[number] = now

    network = Network(n_nodes, LINKS[n_nodes], params, seed, loss=loss, deliver=deliver)
    for which, trace in enumerate(traces):
        for message in _messages(trace.flow, which, n_nodes - 1, trace.sent_at):
            network.send(message)
    network.run(sent[0].count * LASER_S + LATE_S)
    return traces


def reconnection_s(n_nodes: int, seed: int, trials: int, params: Params) -> list[float]:
    """Table V: from the return of a radio until each of two flows has come through again, in s.

    The radio is that of the sender (2 nodes) or of the relay (3 nodes).
    """
    rng = Random(seed)
    return [each for trial in range(trials) for each in _outage(n_nodes, rng, seed + trial, params)]


def _outage(n_nodes: int, rng: Random, seed: int, params: Params) -> Iterable[float]:
    off_s = 1.0 + rng.uniform(0, LASER_S)
    on_s = off_s + OUTAGE_S
    back_s: dict[int, float] = {}

    def deliver(message: Message, now: float) -> None:
        if now > on_s:
            back_s.setdefault(message.number // NUMBERS, now - on_s)

    network = Network(n_nodes, LINKS[n_nodes], params, seed, deliver=deliver)
    n = round((on_s + 2) / LASER_S)
    for which in range(2):
        flow = Flow("laser", KB, LASER_S, n, "latency", phase_s=rng.uniform(0, LASER_S))
        times = flow.times(np.random.default_rng(seed))
        for message in _messages(flow, which, n_nodes - 1, times):
            network.send(message)
    silent = 0 if n_nodes == 2 else 1
    network.call(off_s, lambda: network.switch_off(silent))
    network.call(on_s, lambda: network.switch_on(silent))
    network.run(on_s + 3)
    return back_s.values()


class Shared(NamedTuple):
    """What became of one robot's urgent messages while all others sent bulk."""

    delays_s: list[float]
    sent: int
    carried_mbps: float
    frames: Counter[str]
    worst_s: float
    """Computed: the loop under way with a whole part of bulk, and the loop of the message."""


def share(n_nodes: int, seed: int, duration_s: float, params: Params = OUR_AIR) -> Shared:
    """A team in a full mesh: node 0 sends `URGENT_OCTETS` at random, all others have bulk.

    The priority of the others makes no difference as long as it is lower.
    """
    rng = Random(seed)
    delays_s: list[float] = []
    frames: Counter[str] = Counter()
    carried = 0

    def deliver(message: Message, now: float) -> None:
        nonlocal carried
        carried += message.octets
        if message.priority == URGENT:
            delays_s.append(now - message.at)
        else:
            # There are always two, so that the queue is never empty.
            network.send(message._replace(number=message.number + 2, at=now))

    def watch(frame: Frame, _: float) -> None:
        frames[frame.kind.value] += 1

    network = Network(
        n_nodes, list(combinations(range(n_nodes), 2)), params, seed, deliver=deliver, watch=watch
    )
    for node in range(1, n_nodes):
        dst = node % (n_nodes - 1) + 1
        for number in range(2):
            network.send(Message(number, node, dst, BULK_OCTETS, BULK, 0.0))
    at, n = rng.expovariate(1 / URGENT_PERIOD_S), 0
    while at < duration_s:
        dst = rng.randrange(1, n_nodes)
        network.send(Message(n, 0, dst, URGENT_OCTETS, URGENT, at))
        at, n = at + rng.expovariate(1 / URGENT_PERIOD_S), n + 1
    network.run(duration_s)
    bulk, urgent = (loop_bound(n_nodes, each, params) for each in (BULK_OCTETS, URGENT_OCTETS))
    return Shared(delays_s, n, 8e-6 * carried / duration_s, frames, bulk.seconds + urgent.seconds)


def _messages(flow: Flow, which: int, dst: int, times: Times) -> list[Message]:
    """The messages of a flow from node 0; the laser is the more important."""
    priority = URGENT if flow.qos == "latency" else BULK
    return [
        Message(NUMBERS * which + number, 0, dst, flow.size, priority, float(at))
        for number, at in enumerate(times)
    ]
