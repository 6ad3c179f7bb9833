"""One end of Zenoh: two peers over one TCP link, scouting off. Runs in its own environment."""

import importlib
import queue
import time
from typing import Any

from benchmarks.peers.pound.job import CONTACT_S, Hear, Job, NoContactError

PORT = 7447
PRIORITIES = {"latency": "REAL_TIME", "default": "DATA", "bulk": "BACKGROUND"}


class Zenoh:
    """A Zenoh peer: side "a" listens, "b" connects. Stamps are taken in Zenoh's callback."""

    def __init__(self, job: Job, congestion: str, hear: Hear) -> None:
        # Imported here: it is not installed in the type checker's environment.
        zenoh: Any = importlib.import_module("zenoh")
        self._job, self._hear = job, hear
        self._come: queue.SimpleQueue[tuple[bytes, float]] = queue.SimpleQueue()
        config = zenoh.Config()
        config.insert_json5("mode", '"peer"')
        config.insert_json5("scouting/multicast/enabled", "false")
        config.insert_json5("scouting/gossip/enabled", "false")
        # Both ends share this machine's memory, which two robots would not.
        config.insert_json5("transport/shared_memory/enabled", "false")
        where = ("listen", job.here) if job.side == "a" else ("connect", job.there)
        other = {"listen": "connect", "connect": "listen"}[where[0]]
        config.insert_json5(f"{where[0]}/endpoints", f'["tcp/{where[1]}:{PORT}"]')
        config.insert_json5(f"{other}/endpoints", "[]")
        self._session = zenoh.open(config)
        self._publishers = {
            topic.number: self._session.declare_publisher(
                f"pound/{topic.name}",
                priority=getattr(zenoh.Priority, PRIORITIES[topic.qos]),
                congestion_control=getattr(zenoh.CongestionControl, congestion.upper()),
                express=topic.qos == "latency",
            )
            for topic in job.out
        }
        self._subscribers = [
            self._session.declare_subscriber(f"pound/{topic.name}", self._come_in)
            for topic in job.into
        ]

    def meet(self) -> None:
        """Wait until each publisher knows a subscriber, and the link is up."""
        deadline = time.monotonic() + CONTACT_S
        while not (
            all(publisher.matching_status.matching for publisher in self._publishers.values())
            and self._session.info.peers_zid()
        ):
            if time.monotonic() > deadline:
                raise NoContactError(f"no Zenoh peer matched within {CONTACT_S:.0f} s")
            time.sleep(0.02)

    def send(self, topic: int, message: bytes) -> None:
        """Publish a message; blocks under congestion if Zenoh does."""
        self._publishers[topic].put(message)

    def run(self, until: float) -> None:
        """Hand over what has arrived."""
        while (left := until - time.monotonic()) > 0:
            try:
                message, at = self._come.get(timeout=left)
            except queue.Empty:
                return
            self._hear(message, at)

    def close(self) -> None:
        """Close the session with the other end."""
        self._session.close()

    def _come_in(self, sample: Any) -> None:  # noqa: ANN401
        self._come.put((sample.payload.to_bytes(), time.monotonic()))
