"""Topics over UDP: like UDPROS, nimbro_network and Pound."""

import errno
import heapq
import itertools
import select
import socket
import time
from collections import deque
from collections.abc import Callable, Iterator
from typing import Protocol

from benchmarks.peers.pound.job import Hear, Job, Topic
from benchmarks.peers.pound.reactor import Reactor
from benchmarks.peers.pound.wire import (
    NimbroJoin,
    PoundJoin,
    UdpRosJoin,
    cut_nimbro,
    cut_pound,
    cut_udpros,
)

PORT = 46000
POUND_PORT = 32000
POUND_QUEUE = 50
"""Number of waiting fragments above which Pound rejects messages larger than the next figure."""
POUND_LARGE = 10_000
CATCH_UP = 3
"""Number of fragments whose delay the sender may make up for."""
OVERHEAD = 14 + 20 + 8
"""Bytes of Ethernet, IP and UDP around each datagram."""
RANKS = {"latency": 0, "default": 1, "bulk": 2}


class Join(Protocol):
    """Joins datagrams to messages; `wire` has one for each protocol."""

    def feed(self, datagram: bytes) -> Iterator[bytes]:
        """Messages that this datagram completes."""


class UdpTopic:
    """A separate socket for one topic. It has no handshake: UDP is connectionless."""

    _join: Callable[[], Join]
    """Makes an object that joins datagrams to messages."""

    def __init__(self, reactor: Reactor, topic: Topic, job: Job, hear: Hear) -> None:
        self._reactor, self._topic = reactor, topic
        port = PORT + topic.number
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._numbers = itertools.count(1)
        if topic.sender == job.side:
            self._socket.connect((job.there, port))
        else:
            self._socket.bind((job.here, port))
            join = self._join()
            reactor.when_readable(self._socket, lambda: drain(self._socket, join, hear))

    def meet(self, deadline: float) -> None:
        """Do nothing: there is no connection to wait for."""


class UdpRosTopic(UdpTopic):
    """roscpp's sender: all blocks at once, and a full socket blocks the node.

    A block that does not fit loses its number, so the receiver loses the message. Its data is sent
    under the next number all the same, and so is all later data.
    """

    _join = UdpRosJoin

    def send(self, message: bytes) -> None:
        """Write a message to the socket, however long that takes."""
        broken = False
        blocks = cut_udpros(message, self._topic.number, next(self._numbers) & 0xFF)
        for block in blocks:
            while not put(self._socket, block if not broken else b"\xff" * 8 + block[8:]):
                broken = True
                select.select([], [self._socket], [], 1.0)


class NimbroTopic(UdpTopic):
    """nimbro_network's sender: all fragments at once; only the newest message waits behind them."""

    _join = NimbroJoin

    def __init__(self, reactor: Reactor, topic: Topic, job: Job, hear: Hear) -> None:
        super().__init__(reactor, topic, job, hear)
        self._unsent: deque[bytes] = deque()
        self._newest: bytes | None = None

    def send(self, message: bytes) -> None:
        """Write a message to the socket, or put it into the one waiting place."""
        self._newest = message
        self._write()

    def _write(self) -> None:
        while self._unsent or self._newest is not None:
            if not self._unsent and self._newest is not None:
                name = self._topic.name.encode()
                self._unsent.extend(cut_nimbro(self._newest, next(self._numbers) & 0xFFFF, name))
                self._newest = None
            if not put(self._socket, self._unsent[0]):
                self._reactor.when_writable(self._socket, self._write)
                return
            self._unsent.popleft()
        self._reactor.when_writable(self._socket, None)


class PoundNode:
    """Pound's sender: one socket for all topics, with one queue by priority, then by arrival.

    After each fragment it sleeps for as long as the channel needs for it. It makes up for
    oversleeping, within what the channel's token bucket has saved meanwhile. A large message that
    finds a long queue is discarded.
    """

    def __init__(self, reactor: Reactor, job: Job, hear: Hear) -> None:
        self._reactor, self._job = reactor, job
        self._ranks = {topic.number: RANKS[topic.qos] for topic in job.topics}
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.bind((job.here, POUND_PORT))
        self._queue: list[tuple[int, int, bytes]] = []
        self._numbers, self._arrivals = itertools.count(1), itertools.count()
        self._asleep = False
        self._due = 0.0
        join = PoundJoin()
        reactor.when_readable(self._socket, lambda: drain(self._socket, join, hear))

    def send(self, topic: int, message: bytes) -> None:
        """Put the message's fragments into the node's queue."""
        if len(message) > POUND_LARGE and len(self._queue) > POUND_QUEUE:
            return
        rank = self._ranks[topic]
        for fragment in cut_pound(message, next(self._numbers), 255 - rank, topic):
            heapq.heappush(self._queue, (rank, next(self._arrivals), fragment))
        if not self._asleep:
            self._due = time.monotonic()
            self._next()

    def _next(self) -> None:
        self._asleep = bool(self._queue)
        if self._queue:
            _, _, fragment = heapq.heappop(self._queue)
            put(self._socket, fragment, (self._job.there, POUND_PORT))
            takes_s = 8 * (len(fragment) + OVERHEAD) / self._job.rate_bps
            self._due = takes_s + max(self._due, time.monotonic() - CATCH_UP * takes_s)
            self._reactor.alarm(self._due, self._next)


class PoundTopic:
    """One topic of a PoundNode."""

    def __init__(self, node: PoundNode, topic: Topic) -> None:
        self._node, self._number = node, topic.number

    def meet(self, deadline: float) -> None:
        """Do nothing: there is no connection to wait for."""

    def send(self, message: bytes) -> None:
        """Put the message's fragments into the node's queue."""
        self._node.send(self._number, message)


def put(sock: socket.socket, datagram: bytes, to: tuple[str, int] | None = None) -> bool:
    """Send a datagram; False if the socket was full. What the network rejects is lost silently."""
    try:
        if to is None:
            sock.send(datagram)
        else:
            sock.sendto(datagram, to)
    except BlockingIOError:
        return False
    except OSError as error:
        if error.errno == errno.EMSGSIZE:
            raise
    return True


def drain(sock: socket.socket, join: Join, hear: Hear) -> None:
    """Hand over all messages that have arrived."""
    while True:
        try:
            datagram = sock.recv(1 << 16)
        except BlockingIOError:
            return
        except OSError:
            # An ICMP answer to an earlier datagram, which is reported once.
            continue
        for message in join.feed(datagram):
            hear(message, time.monotonic())
