"""One direction of a serial line: computes when which bytes have left it."""

import math
from collections import deque

BITS_PER_BYTE = 10
"""8N1: eight bits with a start bit and a stop bit."""
PIECE = 144
"""Bytes handed over at once: the start of a long chunk does not wait for its end."""
BUFFER = 4096
"""Bytes that a driver buffers for a busy line."""


class Pacer:
    """Delays bytes: they enter at any time, and leave at baud / 10 per second; times in s."""

    def __init__(self, baud: int) -> None:
        self._byte_s = BITS_PER_BYTE / baud
        self._free = -math.inf
        self._pieces: deque[tuple[float, bytes]] = deque()
        self._queued = 0
        self.dropped = 0
        """Bytes of chunks that did not fit in the buffer."""

    @property
    def due(self) -> float:
        """Time at which the next piece is out; infinity if there is none."""
        return self._pieces[0][0] if self._pieces else math.inf

    def take(self, chunk: bytes, now: float) -> None:
        """Take a chunk written now; its last byte is out at max(now, free) + n * 10 / baud."""
        if self._queued + len(chunk) > BUFFER:
            self.dropped += len(chunk)
            return
        self._queued += len(chunk)
        out = max(now, self._free)
        for begin in range(0, len(chunk), PIECE):
            piece = chunk[begin : begin + PIECE]
            out += len(piece) * self._byte_s
            self._pieces.append((out, piece))
        self._free = out

    def give(self, now: float) -> bytes:
        """Return the bytes that are out by now."""
        out = []
        while self.due <= now:
            piece = self._pieces.popleft()[1]
            self._queued -= len(piece)
            out.append(piece)
        return b"".join(out)
