"""The peers by name, how their ends are connected, and which of them can run here."""

import json
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from typing import NamedTuple

from benchmarks import environments
from benchmarks.peers.latency import ours
from benchmarks.peers.latency.job import Address
from benchmarks.peers.latency.way import End, Way
from benchmarks.processes import precede, start_module
from sdrlinkd.process import Process

BAUD = 921_600
"""The rate of PX4's TELEM2 for a companion computer."""


class Peer(NamedTuple):
    """A system that a team would use."""

    of: str
    """The software that this peer imitates."""
    open: Callable[[int], AbstractContextManager[Way]]
    """Opens a way for messages of the given size in bytes."""
    environment: str = ""
    """The virtual environment that it needs."""


def serial(
    transport: str, environment: str = "", hop: str = ""
) -> Callable[[int], AbstractContextManager[Way]]:
    """A way over a line of 921600 baud; `hop` is the transport of a bridge on the companion."""

    @contextmanager
    def open_way(size: int) -> Iterator[Way]:
        with ExitStack() as stack:
            line = start_module(stack, "line", "benchmarks.peers.latency.wire", str(BAUD))
            precede(line, real_time=True)
            near, far = (Address(transport, device) for device in json.loads(line.line()))
            ends = {"companion": End(near, environment), "fcu": End(far, environment)}
            between = [line]
            if hop:
                arguments = (transport, near.place, str(size))
                module = "benchmarks.peers.latency.bridge"
                bridge = start_module(stack, hop, module, *arguments, environment=environment)
                between.append(bridge)
                precede(bridge, real_time=False)
                ends["companion"] = End(Address("local", bridge.line()))
            yield Way(ends, between, lambda: _late_s(line))

    return open_way


def _late_s(line: Process) -> list[float]:
    """The delays that the line reports at its end."""
    line.close_input()
    late_s: list[float] = json.loads(line.line())
    return late_s


PEERS: dict[str, Peer] = {
    "mavlink": Peer("MAVLink 2, parsed within the node", serial("mavlink", "mavlink"), "mavlink"),
    "mavros": Peer(
        "MAVLink 2, MAVROS between line and node", serial("mavlink", "mavlink", "mavros"), "mavlink"
    ),
    "direct": Peer("sdrlinkd, PDUs straight back", ours.direct),
    "ether": Peer("sdrlinkd, two daemons on a simulated air", ours.ether),
    "xrce": Peer("Micro XRCE-DDS, its agent between line and node", serial("xrce", hop="agent")),
}


def unavailable(peer: str) -> str | None:
    """Why a peer cannot run here, or None if it can; creates the environment that it needs."""
    return environments.unavailable(PEERS, peer)
