"""The hop on the companion computer: between the serial line and the nodes' own middleware.

`python -m benchmarks.peers.latency.bridge TRANSPORT DEVICE SIZE`; like the XRCE agent and MAVROS it
is a process of its own. It prints the port at which it listens, and ends when its input does.
"""

import select
import sys

from benchmarks.peers.latency.job import Address
from benchmarks.peers.latency.local import Local
from benchmarks.peers.latency.transports import open_serial


def main() -> None:
    """Carry messages as the command line says, until the input ends."""
    transport, device, size = sys.argv[1:]
    line = open_serial(Address(transport, device), "companion", int(size))
    nodes = Local()
    print(nodes.port, flush=True)
    while True:
        ready, _, _ = select.select([line, nodes, sys.stdin], [], [])
        if sys.stdin in ready:
            return
        if line in ready:
            for kind, payload in line.receive(0.0):
                nodes.send(kind, payload)
        if nodes in ready:
            for kind, payload in nodes.receive(0.0):
                line.send(kind, payload)


if __name__ == "__main__":
    main()
