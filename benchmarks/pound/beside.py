"""What a team would use instead, in the same run: two namespaces and a token bucket of 6 Mbit/s."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TypeVar

import numpy as np
from rich.console import Console
from rich.progress import Progress

from benchmarks.absent import attempt, tell
from benchmarks.flows import Figures, Flow
from benchmarks.peers.pound import PEERS, unavailable
from benchmarks.peers.pound.control import control_loop, local_loop
from benchmarks.peers.pound.namespaces import available, network
from benchmarks.peers.pound.runs import outage, run_peer, saturate
from benchmarks.pound.tables import by_flow

QUICK = ("tcp_nodelay", "udp", "pound_like")
FIFO = ("tcp_nagle", "tcp_nodelay", "udp", "udp_nod", "nimbro_udp", "nimbro_udp_tcp")
"""Peers without priorities."""
LOOP_S = 3.0

T = TypeVar("T")


def find(quick: bool) -> list[str]:
    """Names of the peers that can run here; reports why the others cannot."""
    if reason := available():
        tell("the peers", reason)
        return []
    found = []
    for name in QUICK if quick else PEERS:
        if reason := unavailable(name):
            tell(name, reason)
        else:
            found.append(name)
    return found


def tables(
    peers: Sequence[str], flows: Sequence[Flow], relay: bool, seed: int
) -> dict[str, dict[str, Figures]]:
    """Tables I to IV, by peer and flow."""

    def one(name: str) -> dict[str, Figures]:
        with network(shared=relay, relay=relay) as on:
            return by_flow(run_peer(name, list(flows), on, seed))

    return _each(peers, f"{'two hops' if relay else 'one hop'}", one)


def bandwidths(
    peers: Sequence[str], sizes: Sequence[int], seconds: float
) -> dict[str, dict[int, float]]:
    """Fig. 19: Mbit/s by peer and size."""

    def one(name: str) -> dict[int, float]:
        found = {}
        for size in sizes:
            # One network each, so that messages still in flight do not affect the next run.
            with attempt(f"{name}, bandwidth at {size} B"), network() as on:
                found[size] = saturate(name, size, seconds, on)
        return found

    return _each(peers, "bandwidth", one)


def recoveries(peers: Sequence[str]) -> dict[str, float]:
    """Table V: recovery time in s by peer, the later of two flows."""

    def one(name: str) -> float:
        with network() as on:
            return max(each.fresh_s for each in outage(name, on))

    return _each(peers, "outage", one)


def loops(peers: Sequence[str], phases: Sequence[float]) -> dict[str, float]:
    """Fig. 21: mean RMS difference to the local run in mV, by peer."""
    local = local_loop(round(LOOP_S / 0.02))

    def one(name: str) -> float:
        runs = [control_loop(name, phase, LOOP_S) for phase in phases]
        return float(np.mean([1e3 * np.sqrt(np.mean((run - local) ** 2)) for run in runs]))

    return _each(peers, "control loop", one)


def _each(peers: Sequence[str], what: str, one: Callable[[str], T]) -> dict[str, T]:
    found = {}
    with _progress(what, len(peers)) as advance:
        for name in peers:
            with attempt(f"{name}, {what}"):
                found[name] = one(name)
            advance()
    return found


@contextmanager
def _progress(what: str, total: int) -> Iterator[Callable[[], None]]:
    console = Console(stderr=True)
    with Progress(console=console, disable=not console.is_terminal, transient=True) as bar:
        task = bar.add_task(what, total=total)
        yield lambda: bar.advance(task)
