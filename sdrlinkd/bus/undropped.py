"""What is told once and must arrive: acknowledgements, announcements, receipts."""

import asyncio
import time
from collections import deque
from collections.abc import Callable, Sequence

import zmq

RETRY_S = 0.001
STUCK_S = 1.0
"""Whoever has not read for so long loses what is for it, as with messages."""


class Undropped:
    """Sends on an XPUB socket and waits where a subscriber's queue is full; order is kept.

    ZeroMQ drops what such a queue has no room for: right for messages, which are numbered, and
    wrong for an answer that somebody waits for. `sent` is called after each use of the socket.
    """

    def __init__(
        self,
        loop: asyncio.AbstractEventLoop,
        socket: zmq.Socket[bytes],
        sent: Callable[[], None],
    ) -> None:
        self._loop = loop
        self._socket = socket
        self._sent = sent
        self._waiting: deque[Sequence[bytes]] = deque()
        self._stuck_since: float | None = None
        self._retry: asyncio.TimerHandle | None = None

    def send(self, frames: Sequence[bytes]) -> None:
        """At once, or as soon as there is room."""
        self._waiting.append(frames)
        if self._retry is None:
            self._send_waiting()

    def close(self, at_most_s: float) -> None:
        """Send what waits, for at most `at_most_s`."""
        deadline = time.monotonic() + at_most_s
        while self._waiting and time.monotonic() < deadline:
            self._send_waiting()
            if self._waiting:
                time.sleep(RETRY_S)
        if self._retry is not None:
            self._retry.cancel()

    def _send_waiting(self) -> None:
        if self._retry is not None:
            self._retry.cancel()
            self._retry = None
        is_stuck = self._stuck_since is not None and (
            time.monotonic() - self._stuck_since > STUCK_S
        )
        # Only for these: a message must not wait for the slowest of its consumers.
        self._socket.setsockopt(zmq.XPUB_NODROP, int(not is_stuck))
        try:
            while self._waiting:
                self._socket.send_multipart(self._waiting[0], zmq.NOBLOCK)
                self._waiting.popleft()
                if not is_stuck:
                    self._stuck_since = None
            self._stuck_since = None
        except zmq.Again:
            if self._stuck_since is None:
                self._stuck_since = time.monotonic()
            self._retry = self._loop.call_later(RETRY_S, self._send_waiting)
        finally:
            self._socket.setsockopt(zmq.XPUB_NODROP, 0)
        self._sent()
