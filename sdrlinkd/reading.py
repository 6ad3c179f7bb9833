"""Reading a ZeroMQ socket from the event loop, without a thread and without waiting."""

import asyncio
from collections.abc import Callable
from typing import Generic, TypeVar

import zmq

Received = TypeVar("Received")

DRAIN_LIMIT = 64


class SocketReader(Generic[Received]):
    """Calls `take` with each message that `receive` yields, `DRAIN_LIMIT` at most a turn.

    ZeroMQ's descriptor is edge-triggered: after any use of the socket it may have become readable
    without a new edge, so whoever sends on it calls `recheck`.
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
        """Look again in the next turn of the loop, if there is something to read."""
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
        # Armed first, so that not even a bug in `take` leaves messages without a reader.
        self._again = self._loop.call_soon(self._drain)
        try:
            for _ in range(DRAIN_LIMIT):
                self._take(self._receive(zmq.NOBLOCK))
        except zmq.Again:
            self._again.cancel()
            self._again = None
