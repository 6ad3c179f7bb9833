"""A Zenoh router in a process of its own: `python -m benchmarks.peers.zenoh_router ENDPOINT`."""

import json
import sys
import threading

import zenoh


def router_config(endpoint: str) -> zenoh.Config:
    """The configuration of a router at an endpoint."""
    config = zenoh.Config()
    for key, value in {
        "mode": "router",
        "listen/endpoints": [endpoint],
        "scouting/multicast/enabled": False,
    }.items():
        config.insert_json5(key, json.dumps(value))
    return config


def main() -> None:
    """Route until killed; prints a line once it listens."""
    with zenoh.open(router_config(sys.argv[1])):
        sys.stdout.write("listening\n")
        sys.stdout.flush()
        threading.Event().wait()


if __name__ == "__main__":
    main()
