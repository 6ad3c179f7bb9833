"""A Zenoh router in a process of its own: `python -m benchmarks.peers.zenoh_router ENDPOINT`."""

import sys
import threading

import zenoh

from benchmarks.peers.zenoh_node import configured


def router_config(endpoint: str) -> zenoh.Config:
    """The configuration of a router at an endpoint."""
    return configured(mode="router", listen=[endpoint])


def main() -> None:
    """Route until killed; prints a line once it listens."""
    with zenoh.open(router_config(sys.argv[1])):
        sys.stdout.write("listening\n")
        sys.stdout.flush()
        threading.Event().wait()


if __name__ == "__main__":
    main()
