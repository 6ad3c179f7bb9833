"""Samples in and out by the three socket patterns of gr-zeromq; handles bytes only."""

import struct
from typing import Literal, Protocol

import zmq

from backends.zmqstream.endpoint import Socket, open_endpoint

Pattern = Literal["push", "pub", "req"]
NOBLOCK = int(zmq.NOBLOCK)
_COUNT = struct.Struct("<I")
WAITING = 16
"""Number of requests that may wait for a peer."""


class Source(Protocol):
    """The socket that samples are read from."""

    socket: Socket

    def next(self) -> bytes | None:
        """Return the next message, or None if none is waiting."""


class Sink(Protocol):
    """The socket that samples are written to."""

    socket: Socket

    def wanted(self, have: int) -> int:
        """How many of `have` samples the peer accepts in one message now."""

    def send(self, data: bytes) -> bool:
        """Send a message; False when there is no room for it after all."""


def open_source(context: zmq.Context[Socket], pattern: Pattern, endpoint: str) -> Source:
    """Open a PULL, SUB or REQ socket. Raises BackendError."""
    kind = {"push": zmq.PULL, "pub": zmq.SUB, "req": zmq.REQ}[pattern]
    socket = open_endpoint(context, kind, endpoint, "zmq.receive", binds=False, ahead=WAITING)
    if pattern == "pub":
        socket.setsockopt(zmq.SUBSCRIBE, b"")
    return _Asking(socket) if pattern == "req" else _Listening(socket)


def open_sink(context: zmq.Context[Socket], pattern: Pattern, endpoint: str, ahead: int) -> Sink:
    """Open a PUSH, PUB or REP socket; at most `ahead` messages wait in it. Raises BackendError."""
    kind = {"push": zmq.PUSH, "pub": zmq.PUB, "req": zmq.REP}[pattern]
    socket = open_endpoint(context, kind, endpoint, "zmq.send", binds=True, ahead=ahead)
    return _Answering(socket) if pattern == "req" else _Telling(socket)


class _Listening:
    """A PULL or SUB socket; samples are the last part of a message, behind gr-zeromq's key."""

    def __init__(self, socket: Socket) -> None:
        self.socket = socket

    def next(self) -> bytes | None:
        try:
            return self.socket.recv_multipart(NOBLOCK)[-1]
        except zmq.Again:
            return None


class _Asking(_Listening):
    """A REQ socket: GNU Radio's rep_sink expects the number of items, srsRAN takes any request."""

    MOST = 4096

    def __init__(self, socket: Socket) -> None:
        super().__init__(socket)
        socket.setsockopt(zmq.REQ_RELAXED, 1)
        socket.setsockopt(zmq.REQ_CORRELATE, 0)
        self._waits = False

    def next(self) -> bytes | None:
        answer = super().next() if self._waits else None
        if answer is not None:
            self._waits = False
        if not self._waits:
            try:
                self.socket.send(_COUNT.pack(self.MOST), NOBLOCK)
                self._waits = True
            except zmq.Again:
                pass
        return answer


class _Telling:
    """A sink that sends without a request, by PUSH or PUB."""

    def __init__(self, socket: Socket) -> None:
        self.socket = socket

    def wanted(self, have: int) -> int:
        return have

    def send(self, data: bytes) -> bool:
        try:
            self.socket.send(data, NOBLOCK)
        except zmq.Again:
            return False
        return True


class _Answering:
    """A REP socket: four bytes request a number of items (GNU Radio), one byte any (srsRAN)."""

    def __init__(self, socket: Socket) -> None:
        self.socket = socket
        self._asked = 0

    def wanted(self, have: int) -> int:
        if not self._asked:
            try:
                request = self.socket.recv(NOBLOCK)
            except zmq.Again:
                return 0
            self._asked = _COUNT.unpack(request)[0] if len(request) == _COUNT.size else 1 << 31
        return min(have, self._asked)

    def send(self, data: bytes) -> bool:
        self._asked = 0
        self.socket.send(data)
        return True
