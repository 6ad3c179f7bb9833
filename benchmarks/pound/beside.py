"""What a team would use instead, in the same run: two namespaces on an air of 6 Mbit/s."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TypeVar

import numpy as np
from rich.console import Console
from rich.progress import Progress

from benchmarks.absent import attempt, tell
from benchmarks.flows import Figures, Flow
from benchmarks.peers.pound import PEERS, unavailable
from benchmarks.peers.pound.control import control_loop, rms_mv
from benchmarks.peers.pound.namespaces import Discipline, available, network
from benchmarks.peers.pound.runs import Recovery, outage, run_peer, saturate
from benchmarks.pound.tables import by_flow

QUICK = ("tcp_nodelay", "udp", "pound_like")
FIFO = ("tcp_nagle", "tcp_nodelay", "udp", "udp_nod", "nimbro_udp", "nimbro_udp_tcp")
"""Peers without priorities."""
QUEUED = ("tcp_nodelay", "udp_nod")
"""Peers that also run behind a queue discipline."""
DISCIPLINES: tuple[Discipline, ...] = ("laser_first", "fq_codel")
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

    return each(peers, f"{'two hops' if relay else 'one hop'}", one)


def one_channel(
    peers: Sequence[str], flows: Sequence[Flow], seed: int
) -> dict[str, dict[str, Figures]]:
    """Tables I and II on one channel for both directions; QUEUED also behind each discipline."""
    ways: dict[str, tuple[str, Discipline]] = {name: (name, "fifo") for name in peers}
    ways |= {f"{name}_{way}": (name, way)
             for name in QUEUED if name in peers for way in DISCIPLINES}  # fmt: skip

    def one(name: str) -> dict[str, Figures]:
        peer, discipline = ways[name]
        with network(shared=True, discipline=discipline) as on:
            return by_flow(run_peer(peer, list(flows), on, seed))

    return each([*ways], "one channel", one)


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

    return each(peers, "bandwidth", one)


def recoveries(
    peers: Sequence[str], *, shared: bool = False, relay: bool = False
) -> dict[str, Recovery]:
    """Table V: recovery by peer, the later of two flows."""

    def one(name: str) -> Recovery:
        with network(shared=shared, relay=relay) as on:
            return Recovery(*map(float, np.max(outage(name, on), axis=0)))

    return each(peers, f"outage{', one channel' * shared}{', two hops' * relay}", one)


def loops(peers: Sequence[str], phases: Sequence[float]) -> dict[str, float]:
    """Fig. 21: mean RMS difference to the local run in mV, by peer."""

    def one(name: str) -> float:
        return float(np.mean([rms_mv(control_loop(name, phase, LOOP_S)) for phase in phases]))

    return each(peers, "control loop", one)


def each(peers: Sequence[str], what: str, one: Callable[[str], T]) -> dict[str, T]:
    """What `one` measures of each peer; reports as `what` those of which it cannot."""
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
