"""A serial line with a pacer each way, in a process of its own.

`python -m benchmarks.peers.latency.wire BAUD [tcp]` prints the two ends of the line as JSON: paths
of pseudo-terminals, or TCP ports. It carries bytes until its input ends, and then prints the delay
of each piece in s. TCP stands for a program such as ser2net, which offers a serial device at a
port. The kernel carries the bytes either way, and the pacers are the same.
"""

import json
import os
import select
import socket
import sys
import time
import tty
from collections.abc import Callable

from benchmarks.peers.latency.pacer import Pacer

CHUNK = 1024
SPIN_S = 250e-6
"""Sleeps end late by about this much, so the rest of a wait is polled."""


class Wire:
    """The line between two open files."""

    def __init__(self, baud: int, a: int, b: int) -> None:
        self._ways = {a: (b, Pacer(baud)), b: (a, Pacer(baud))}
        """By the descriptor read from: the descriptor written to, and its pacer."""
        self.late_s: list[float] = []

    def run(self, stop: int) -> None:
        """Carry bytes until the file `stop` or an end of the line ends."""
        while True:
            due = min(pacer.due for _, pacer in self._ways.values())
            wait = due - time.monotonic() - SPIN_S
            timeout = None if due == float("inf") else max(0.0, wait)
            ready, _, _ = select.select([*self._ways, stop], [], [], timeout)
            if stop in ready:
                return
            for source in ready:
                chunk = os.read(source, CHUNK)
                if not chunk:
                    return
                self._ways[source][1].take(chunk, time.monotonic())
            for sink, pacer in self._ways.values():
                due = pacer.due
                if out := pacer.give(time.monotonic()):
                    os.write(sink, out)
                    self.late_s.append(time.monotonic() - due)


def terminals() -> tuple[list[str], Callable[[], list[int]]]:
    """Two devices, and what opens our ends: raw, without echo or line discipline."""
    pairs = [os.openpty() for _ in range(2)]
    # We keep both sides open: otherwise reads would fail until an end has opened its device.
    for ends in pairs:
        for end in ends:
            tty.setraw(end)
    return [os.ttyname(device) for _, device in pairs], lambda: [ours for ours, _ in pairs]


def ports() -> tuple[list[str], Callable[[], list[int]]]:
    """Two TCP ports, and what waits for a program at each."""
    listening = [socket.create_server(("127.0.0.1", 0)) for _ in range(2)]

    def accept() -> list[int]:
        found = [each.accept()[0] for each in listening]
        for each in found:
            each.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return [each.detach() for each in found]

    return [str(each.getsockname()[1]) for each in listening], accept


def main() -> None:
    """Run the line as the command line says, until the input ends."""
    baud, *kind = sys.argv[1:]
    places, opened = ports() if kind == ["tcp"] else terminals()
    print(json.dumps(places), flush=True)
    wire = Wire(int(baud), *opened())
    wire.run(sys.stdin.fileno())
    print(json.dumps(wire.late_s), flush=True)


if __name__ == "__main__":
    main()
