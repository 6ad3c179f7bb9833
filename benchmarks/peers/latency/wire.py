"""A serial line: two pairs of pseudo-terminals and a pacer each way, in a process of its own.

`python -m benchmarks.peers.latency.wire BAUD` prints the two devices as JSON, carries bytes until
its input ends, and then prints the delay of each piece in s.
"""

import json
import os
import select
import sys
import time
import tty

from benchmarks.peers.latency.pacer import Pacer

CHUNK = 1024
SPIN_S = 250e-6
"""Sleeps end late by about this much, so the rest of a wait is polled."""


class Wire:
    """Both devices are raw: no echo, no line discipline between the bytes."""

    def __init__(self, baud: int) -> None:
        pairs = [os.openpty() for _ in range(2)]
        # We keep ours open: otherwise reads would fail until an end has opened its device.
        for ends in pairs:
            for end in ends:
                tty.setraw(end)
        self.devices = [os.ttyname(device) for _, device in pairs]
        (a, _), (b, _) = pairs
        self._ways = {a: (b, Pacer(baud)), b: (a, Pacer(baud))}
        """By the descriptor read from: the descriptor written to, and its pacer."""
        self.late_s: list[float] = []

    def run(self, stop: int) -> None:
        """Carry bytes until the file `stop` ends."""
        while True:
            due = min(pacer.due for _, pacer in self._ways.values())
            wait = due - time.monotonic() - SPIN_S
            timeout = None if due == float("inf") else max(0.0, wait)
            ready, _, _ = select.select([*self._ways, stop], [], [], timeout)
            if stop in ready:
                return
            for source in ready:
                self._ways[source][1].take(os.read(source, CHUNK), time.monotonic())
            for sink, pacer in self._ways.values():
                due = pacer.due
                if out := pacer.give(time.monotonic()):
                    os.write(sink, out)
                    self.late_s.append(time.monotonic() - due)


def main() -> None:
    """Run the line as the command line says, until the input ends."""
    wire = Wire(int(sys.argv[1]))
    print(json.dumps(wire.devices), flush=True)
    wire.run(sys.stdin.fileno())
    print(json.dumps(wire.late_s), flush=True)


if __name__ == "__main__":
    main()
