"""Reads a ZeroMQ socket from the event loop, without a thread and without blocking."""

import asyncio
from collections.abc import Callable
from typing import Generic, TypeVar

import zmq

Received = TypeVar("Received")

DRAIN_LIMIT = 64


class SocketReader(Generic[Received]):
    """Calls `take` with each message from `receive`, at most `DRAIN_LIMIT` per turn of the loop.

    ZeroMQ's descriptor is edge-triggered. After any use of the socket it may be readable without a
    new edge, so code that sends on the socket must call `recheck`.
    """

    def __init__(
        self,
        loop: asyncio.AbstractEventLoop,
        socket: zmq.Socket[bytes],
        receive: Callable[[int], Received],
        take: Callable[[Received], None],
    ) -> None:
        self._loop = loop
        self._socket = socket
        self._take = take
        self._receive = receive
        self._descriptor: int = socket.getsockopt(zmq.FD)  # type: ignore[assignment]
        self._again: asyncio.Handle | None = None
        loop.add_reader(self._descriptor, self._drain)
        self.recheck()

    def recheck(self) -> None:
        """Read in the next turn of the loop, if there is something to read."""
        if self._again is None and self._readable():
            self._again = self._loop.call_soon(self._drain)

    def _readable(self) -> bool:
        return bool(int(self._socket.getsockopt(zmq.EVENTS)) & zmq.POLLIN)

    def close(self) -> None:
        """Stop reading; the socket stays open."""
        self._loop.remove_reader(self._descriptor)
        if self._again is not None:
            self._again.cancel()

    def _drain(self) -> None:
        if self._again is not None:
            self._again.cancel()
        # Scheduled first, so that messages are still read after an exception in `take`.
        self._again = self._loop.call_soon(self._drain)
        try:
            for _ in range(DRAIN_LIMIT):
                self._take(self._receive(zmq.NOBLOCK))
        except zmq.Again:
            self._again.cancel()
            self._again = None
