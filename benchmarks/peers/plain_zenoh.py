"""A bridge without any of our rules: what a daemon hears, put on Zenoh as it comes.

`python -m benchmarks.peers.plain_zenoh FOLDER TOPIC ENDPOINT`, with the daemon's folder.
"""

import sys

import zenoh

from benchmarks.peers.zenoh_node import configured
from sdrlinkd.client import Subscriber

KEY = "plain"


def plain_config(endpoint: str) -> zenoh.Config:
    """A client of the router at an endpoint."""
    return configured(mode="client", connect=[endpoint])


def main() -> None:
    """Put until killed; prints a line once it listens."""
    folder, topic, endpoint = sys.argv[1:]
    session = zenoh.open(plain_config(endpoint))
    publisher = session.declare_publisher(KEY)
    with Subscriber(topic, runtime_dir=folder) as heard:
        sys.stdout.write("listening\n")
        sys.stdout.flush()
        while True:
            message = heard.receive(1.0)
            if message is not None:
                publisher.put(message.payload)


if __name__ == "__main__":
    main()
