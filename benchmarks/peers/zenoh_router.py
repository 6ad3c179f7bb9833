"""A Zenoh router in a process of its own: `python -m benchmarks.peers.zenoh_router ENDPOINT`."""

import json
import sys
import threading

import zenoh


def main() -> None:
    """Route until killed; prints a line once it listens."""
    config = zenoh.Config()
    for key, value in {
        "mode": "router",
        "listen/endpoints": [sys.argv[1]],
        "scouting/multicast/enabled": False,
    }.items():
        config.insert_json5(key, json.dumps(value))
    with zenoh.open(config):
        sys.stdout.write("listening\n")
        sys.stdout.flush()
        threading.Event().wait()


if __name__ == "__main__":
    main()
