"""The experiments of section VI with one or more flows: Tables I to V, Fig. 19."""

import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from benchmarks.flows import Flow, Trace
from benchmarks.peers.pound.ends import Plan, run_ends
from benchmarks.peers.pound.job import Topic
from benchmarks.peers.pound.namespaces import Network

DRAIN_S = 5.0
OFFERED_BPS = 6.5e6
FRESH_S = 0.01
STAYS, HICCUPS = 50, 2
"""Number of messages in a row, of which HICCUPS may be late: a machine pauses now and then."""


class Recovery(NamedTuple):
    """How a flow recovers after the link is up again; in s, NaN if it does not."""

    first_s: float
    """Time until its first message, however old."""
    fresh_s: float
    """Time until the first message younger than 10 ms from which on they stay as young."""
    new_s: float
    """Time until the first message that was sent since."""


def run_peer(
    peer: str, flows: list[Flow], network: Network, seed: int, *, drain_s: float = DRAIN_S
) -> list[Trace]:
    """Run all flows from A to B, of messages of 16 bytes and more; times in s from the start.

    A message counts as sent when its producer has it, even if the peer cannot accept it yet:
    waiting in the sender is delay. Stops `drain_s` after the last message, whatever happens.
    """
    return _run(peer, flows, network, seed, drain_s)


def _run(
    peer: str,
    flows: list[Flow],
    network: Network,
    seed: int,
    drain_s: float,
    during: Callable[[float], None] | None = None,
) -> list[Trace]:
    rng = np.random.default_rng(seed)
    times = [flow.times(rng) for flow in flows]
    topics = [Topic(i, flow.name, flow.size, flow.qos, "a") for i, flow in enumerate(flows)]
    sends = sorted((float(at), i, n) for i, of in enumerate(times) for n, at in enumerate(of))
    plan = Plan(topics, {"a": sends}, sends[-1][0] + drain_s)
    told = run_ends(peer, plan, network, during)
    traces = []
    for i, flow in enumerate(flows):
        heard_at = np.full(flow.count, np.nan)
        for n, at in told["b"].heard[i].items():
            if n < flow.count:  # else left over from whoever used this network before
                heard_at[n] = at
        traces.append(Trace(flow, times[i], heard_at))
    return traces


def saturate(peer: str, size: int, seconds: float, network: Network) -> float:
    """Mbit/s of messages of `size` bytes that arrive while 6.5 Mbit/s of them are offered.

    The first half second is not counted, because the queues fill.
    """
    period_s = 8 * size / OFFERED_BPS
    flow = Flow("load", size, period_s, int(seconds / period_s))
    (trace,) = run_peer(peer, [flow], network, 0, drain_s=0.5)
    began, ended = 0.5, flow.count * period_s
    arrived = np.sum((trace.heard_at > began) & (trace.heard_at <= ended))
    return float(8e-6 * size * arrived / (ended - began))


def outage(
    peer: str,
    network: Network,
    seed: int = 0,
    *,
    before_s: float = 2.0,
    down_s: float = 5.0,
    after_s: float = 10.0,
) -> list[Recovery]:
    """Two flows of 1 KB every 20 ms; the sender's or the relay's link goes down for `down_s`."""
    count = round((before_s + down_s + after_s) / 0.02)
    flows = [
        Flow("first", 1024, 0.02, count, "latency"),
        Flow("second", 1024, 0.02, count, phase_s=0.01),
    ]
    cut = _Outage(network, before_s, down_s)
    traces = _run(peer, flows, network, seed, 1.0, cut.begin)
    return [recovery(trace, cut.up_s) for trace in traces]


class _Outage:
    """A link that is cut some time after the start."""

    def __init__(self, network: Network, before_s: float, down_s: float) -> None:
        self._network, self._before_s, self._down_s = network, before_s, down_s
        self.up_s = float("nan")
        """Time at which the link was up again, in s from the start."""

    def begin(self, start: float) -> None:
        """Cut the link, and return when it is up again."""
        time.sleep(max(0.0, start + self._before_s - time.monotonic()))
        self.up_s = self._network.outage(self._down_s)[1] - start


def recovery(trace: Trace, up_s: float) -> Recovery:
    """Recovery of a flow after its link was up again at `up_s`, in s from the start."""
    order = np.argsort(trace.heard_at)
    order = order[trace.heard_at[order] > up_s]
    if not len(order):
        return Recovery(float("nan"), float("nan"), float("nan"))
    arrived_s = trace.heard_at[order] - up_s
    late = trace.heard_at[order] - trace.sent_at[order] >= FRESH_S
    fresh_s = (
        arrived_s[i]
        for i in np.flatnonzero(~late)
        if np.sum(late[i : i + STAYS]) <= HICCUPS and len(late) - i >= STAYS
    )
    new_s = arrived_s[trace.sent_at[order] > up_s]
    return Recovery(
        float(arrived_s[0]),
        float(next(fresh_s, np.nan)),
        float(new_s[0]) if len(new_s) else float("nan"),
    )
