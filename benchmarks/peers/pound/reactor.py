"""Waits for sockets and for one alarm in one thread: no locks or thread switches add jitter."""

import math
import select
import socket
import time
from collections.abc import Callable

SPIN_S = 0.0002
"""Time before a deadline in which to poll instead of sleep: timers are late by up to this much."""

Do = Callable[[], None]


class Reactor:
    """Calls the registered handlers from `run`."""

    def __init__(self) -> None:
        self._readers: dict[socket.socket, Do] = {}
        self._writers: dict[socket.socket, Do] = {}
        self._alarm_at = math.inf
        self._ring: Do = lambda: None

    def when_readable(self, sock: socket.socket, do: Do) -> None:
        """Call `do` whenever there is something to read."""
        self._readers[sock] = do

    def when_writable(self, sock: socket.socket, do: Do | None) -> None:
        """Call `do` whenever there is room to write; None stops it."""
        if do is None:
            self._writers.pop(sock, None)
        else:
            self._writers[sock] = do

    def forget(self, sock: socket.socket) -> None:
        """Close a socket and remove its handlers."""
        self._readers.pop(sock, None)
        self._writers.pop(sock, None)
        sock.close()

    def alarm(self, at: float, ring: Do) -> None:
        """Call `ring` once, not before `at`, with the delay of a sleep; there is only one alarm."""
        self._alarm_at, self._ring = at, ring

    def run(self, until: float) -> None:
        """Handle events until that time (monotonic s), at least once."""
        while True:
            left = min(until - SPIN_S, self._alarm_at) - time.monotonic()
            ready = select.select([*self._readers], [*self._writers], [], max(0.0, left))
            for sock in ready[0]:
                if sock in self._readers:
                    self._readers[sock]()
            for sock in ready[1]:
                if sock in self._writers:
                    self._writers[sock]()
            now = time.monotonic()
            if now >= self._alarm_at:
                self._alarm_at = math.inf
                self._ring()
            if now >= until:
                return

    def close(self) -> None:
        """Close all registered sockets."""
        for sock in {*self._readers, *self._writers}:
            self.forget(sock)
