"""A Zenoh router in a process of its own.

`python -m benchmarks.peers.zenoh_router FILE ENDPOINT…`, where the file is one of Zenoh's, with
certificates, or empty.
"""

import sys
import threading

import zenoh

from benchmarks.peers.zenoh_node import configured


def router_config(*endpoints: str, file: str = "") -> zenoh.Config:
    """The configuration of a router at endpoints; `file`: with the certificates in it."""
    config = zenoh.Config.from_file(file) if file else zenoh.Config()
    return configured(config, mode="router", listen=endpoints)


def main() -> None:
    """Route until killed; prints a line once it listens."""
    file, *endpoints = sys.argv[1:]
    with zenoh.open(router_config(*endpoints, file=file)):
        sys.stdout.write("listening\n")
        sys.stdout.flush()
        threading.Event().wait()


if __name__ == "__main__":
    main()
