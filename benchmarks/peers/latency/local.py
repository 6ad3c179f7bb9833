"""A transport between two processes of the companion computer: datagrams over the loopback."""

import select
import socket
from collections.abc import Iterator

DATAGRAM = 2048
HELLO = b""


class Local:
    """Sends each message as a datagram: its kind in one byte, then its payload.

    The side without a peer's port waits for a first message, and drops what it should send before
    that.
    """

    def __init__(self, port: int | None = None) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self.port: int = self._socket.getsockname()[1]
        self._peer: tuple[str, int] | None = None
        if port is not None:
            self._peer = ("127.0.0.1", port)
            self._socket.sendto(HELLO, self._peer)

    def fileno(self) -> int:
        """Descriptor that is readable when there is something to receive."""
        return self._socket.fileno()

    def send(self, kind: int, payload: bytes) -> None:
        """Send a message at once if the peer is known."""
        if self._peer:
            self._socket.sendto(bytes([kind]) + payload, self._peer)

    def receive(self, timeout_s: float) -> Iterator[tuple[int, bytes]]:
        """Wait for one message and yield it."""
        if select.select([self._socket], [], [], timeout_s)[0]:
            datagram, self._peer = self._socket.recvfrom(DATAGRAM)
            if datagram:
                yield datagram[0], datagram[1:]
