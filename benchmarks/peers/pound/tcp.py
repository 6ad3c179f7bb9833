"""Topics over TCP: like TCPROS, with Nagle's algorithm or without, and like nimbro_network."""

import socket
import time
from collections import deque
from collections.abc import Callable

from benchmarks.peers.pound.job import Hear, Job, NoContactError, Topic
from benchmarks.peers.pound.reactor import Reactor
from benchmarks.peers.pound.wire import NimbroTcpJoin, TcpRosJoin, cut_nimbro_tcp, cut_tcpros

PORT = 45000
PIECE = 1 << 16
ACK = b"\x06"
QUEUE = 20
"""Number of messages that nimbro_network's TCP sender keeps per topic, the newest ones."""


class TcpTopic:
    """One connection, made by the subscriber. Data that does not fit in the socket waits here.

    That queue is unbounded, like ROS 1's queue_size 0, and does not block other topics.

    Nagle's algorithm costs time only if acknowledgements are delayed. Since the end of 2023 Linux
    acknowledges a message as soon as it is read; `delayed_ack` requests the previous behaviour.
    """

    def __init__(
        self,
        reactor: Reactor,
        topic: Topic,
        job: Job,
        hear: Hear,
        *,
        nodelay: bool,
        delayed_ack: bool = False,
    ) -> None:
        self._reactor, self._job, self._hear = reactor, job, hear
        self._nodelay, self._delayed_ack = nodelay, delayed_ack
        self._port = PORT + topic.number
        self._join = TcpRosJoin() if type(self) is TcpTopic else NimbroTcpJoin()
        self._unsent: deque[memoryview] = deque()
        self._listener: socket.socket | None = None
        if topic.sender == job.side:
            self._listener = socket.create_server((job.here, self._port))

    def meet(self, deadline: float) -> None:
        """Connect, or wait for a connection."""
        if self._listener:
            self._listener.settimeout(max(0.01, deadline - time.monotonic()))
            try:
                self._socket, _ = self._listener.accept()
            except TimeoutError:
                raise NoContactError(f"nobody connected to TCP port {self._port}") from None
            self._listener.close()
        else:
            self._socket = self._connect(deadline)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, self._nodelay)
        self._socket.setblocking(False)
        self._reactor.when_readable(self._socket, self._read)

    def send(self, message: bytes) -> None:
        """Queue a message behind the data that is not yet in the socket."""
        self._unsent.append(memoryview(cut_tcpros(message)))
        self._write()

    def _connect(self, deadline: float) -> socket.socket:
        while True:
            try:
                return socket.create_connection((self._job.there, self._port), 1.0)
            except OSError as error:
                if time.monotonic() > deadline:
                    raise NoContactError(f"TCP port {self._port}: {error}") from None
            time.sleep(0.02)

    def _write(self) -> None:
        try:
            while self._unsent:
                data = self._unsent[0]
                sent = self._socket.send(data)
                if sent == len(data):
                    self._unsent.popleft()
                else:
                    self._unsent[0] = data[sent:]
        except BlockingIOError:
            pass
        except OSError:
            self._lose()
            return
        self._reactor.when_writable(self._socket, self._write if self._unsent else None)

    def _read(self) -> None:
        try:
            # Before each read, because the kernel treats it as a hint and reverts it.
            if self._delayed_ack:
                self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_QUICKACK, 0)
            while piece := self._socket.recv(PIECE):
                self._take(piece)
        except BlockingIOError:
            return
        except OSError:
            pass
        self._lose()

    def _take(self, piece: bytes) -> None:
        for message in self._join.feed(piece):
            self._hear(message, time.monotonic())

    def _lose(self) -> None:
        """Note that the connection is gone: nothing is sent or received any more."""
        self._reactor.forget(self._socket)
        self._unsent.clear()


class NimbroTcpTopic(TcpTopic):
    """Stop and wait: the next message is sent when the receiver has acknowledged the one before."""

    def __init__(self, reactor: Reactor, topic: Topic, job: Job, hear: Hear) -> None:
        super().__init__(reactor, topic, job, hear, nodelay=False)
        self._name = topic.name.encode()
        self._waiting: deque[bytes] = deque(maxlen=QUEUE)
        self._sends = topic.sender == job.side
        self._busy = False

    def send(self, message: bytes) -> None:
        """Queue a message; of more than twenty, the oldest is dropped."""
        self._waiting.append(message)
        self._next()

    def _next(self) -> None:
        if not self._busy and self._waiting:
            self._busy = True
            self._unsent.append(memoryview(cut_nimbro_tcp(self._waiting.popleft(), self._name)))
            self._write()

    def _take(self, piece: bytes) -> None:
        if self._sends:
            self._busy = False
            self._next()
            return
        for message in self._join.feed(piece):
            self._hear(message, time.monotonic())
            self._unsent.append(memoryview(ACK))
            self._write()


def tcp_topic(
    *, nodelay: bool, delayed_ack: bool = False
) -> Callable[[Reactor, Topic, Job, Hear], TcpTopic]:
    """Make a function that opens TCPROS topics, with Nagle's algorithm or without."""

    def opened(reactor: Reactor, topic: Topic, job: Job, hear: Hear) -> TcpTopic:
        return TcpTopic(reactor, topic, job, hear, nodelay=nodelay, delayed_ack=delayed_ack)

    return opened
