"""The peers that are plain sockets, with one transport per topic, chosen by its class."""

import time
from collections.abc import Callable
from typing import Protocol

from benchmarks.peers.pound.job import CONTACT_S, Hear, Job, Topic
from benchmarks.peers.pound.reactor import Reactor
from benchmarks.peers.pound.tcp import NimbroTcpTopic, tcp_topic
from benchmarks.peers.pound.udp import NimbroTopic, PoundNode, PoundTopic, UdpRosTopic


class Transport(Protocol):
    """Carries one topic's messages."""

    def meet(self, deadline: float) -> None:
        """Wait for the other end."""

    def send(self, message: bytes) -> None:
        """Send a message of this topic."""


Open = Callable[[Reactor, Topic, Job, Hear], Transport]

TRANSPORTS: dict[str, Open] = {
    "tcp_nagle": tcp_topic(nodelay=False),
    "tcp_delayed_ack": tcp_topic(nodelay=False, delayed_ack=True),
    "tcp_nodelay": tcp_topic(nodelay=True),
    "udpros": UdpRosTopic,
    "nimbro_udp": NimbroTopic,
    "nimbro_tcp": NimbroTcpTopic,
}


class Sockets:
    """One end of a peer with plain sockets."""

    def __init__(self, job: Job, transports: dict[str, str], hear: Hear) -> None:
        self._reactor = Reactor()
        self._transports: dict[int, Transport] = {}
        node: PoundNode | None = None
        for topic in job.topics:
            name = transports.get(topic.qos, transports["default"])
            if name == "pound":
                node = node or PoundNode(self._reactor, job, hear)
                self._transports[topic.number] = PoundTopic(node, topic)
            else:
                self._transports[topic.number] = TRANSPORTS[name](self._reactor, topic, job, hear)

    def meet(self) -> None:
        """Connect topic by topic, in the same order at both ends."""
        deadline = time.monotonic() + CONTACT_S
        for transport in self._transports.values():
            transport.meet(deadline)

    def send(self, topic: int, message: bytes) -> None:
        """Send a message over its topic's transport."""
        self._transports[topic].send(message)

    def run(self, until: float) -> None:
        """Serve all sockets until that time."""
        self._reactor.run(until)

    def close(self) -> None:
        """Close the sockets of all topics."""
        self._reactor.close()
