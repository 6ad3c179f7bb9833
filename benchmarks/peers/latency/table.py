"""The peers by name, how their ends are connected, and which of them can run here."""

import json
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from typing import NamedTuple

from benchmarks import environments
from benchmarks.peers.latency import ours
from benchmarks.peers.latency.job import Address
from benchmarks.peers.latency.pacer import BITS_PER_BYTE
from benchmarks.peers.latency.way import End, Way, late_s
from benchmarks.processes import precede, start_module

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
    overhead: int | None = None
    """Octets on the line beside a message's payload; None: there is no line."""

    def on_the_line_s(self, size: int) -> float | None:
        """The time that the line takes for a message of `size` bytes; None: there is no line."""
        return None if self.overhead is None else (size + self.overhead) * BITS_PER_BYTE / BAUD


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
            yield Way(ends, between, lambda: late_s(line))

    return open_way


PEERS: dict[str, Peer] = {
    "mavlink": Peer(
        "MAVLink 2, parsed within both programs; the line",
        serial("mavlink", "mavlink"),
        "mavlink",
        12,
    ),
    "mavros": Peer(
        "MAVLink 2; MAVROS between one program and the line",
        serial("mavlink", "mavlink", "mavros"),
        "mavlink",
        12,
    ),
    "xrce": Peer(
        "Micro XRCE-DDS; its agent between one program and the line",
        serial("xrce", hop="agent"),
        overhead=19,
    ),
    "line": Peer(
        "sdrlinkd; a daemon between each program and the line",
        lambda size: ours.line(BAUD, size),
        overhead=ours.PDU_OVERHEAD,
    ),
    "direct": Peer(
        "sdrlinkd without a line: one daemon, whose PDUs come straight back", ours.direct
    ),
    "ether": Peer("sdrlinkd without a line: two daemons on a simulated air", ours.ether),
}


def unavailable(peer: str) -> str | None:
    """Why a peer cannot run here, or None if it can; creates the environment that it needs."""
    return environments.unavailable(PEERS, peer)
