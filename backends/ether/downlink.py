"""Reads what the hub sends to a radio, and merges stretches when the radio has fallen behind."""

import contextlib
from collections import deque

import msgspec
import numpy as np
import zmq

from backends.base import Samples
from backends.ether import protocol
from backends.ether.sockets import NOBLOCK, is_readable

MOST_AT_ONCE = 8


class Downlink:
    """Reads a radio's DEALER socket; for use in one thread."""

    def __init__(self, socket: "zmq.Socket[bytes]") -> None:
        self._socket = socket
        self._waiting: deque[tuple[protocol.FromHub, Samples | None]] = deque()

    def read(self, flags: int) -> tuple[protocol.FromHub, Samples | None]:
        """Return the next message and its samples from the socket. Raises zmq.Again."""
        frames = self._socket.recv_multipart(flags)
        return protocol.from_hub(frames[0]), protocol.samples_in(frames)

    def has_more(self) -> bool:
        """Whether a message is waiting; cheaper than a `read` that fails."""
        return is_readable(self._socket)

    def next(self) -> tuple[protocol.FromHub, Samples | None]:
        """Return the next message; waits up to the socket's timeout. Raises zmq.Again."""
        return self._waiting.popleft() if self._waiting else self.read(0)

    def with_more(
        self, first: protocol.Stretch, samples: Samples | None
    ) -> tuple[protocol.Stretch, Samples | None]:
        """Merge a stretch with those waiting behind it: the cost is per stretch, not per sample."""
        parts = [(first.n, samples)]
        last, placed, notice = first, list(first.placed), first.notice
        with contextlib.suppress(zmq.Again):
            while len(parts) < MOST_AT_ONCE and not last.step and self.has_more():
                each, more = self.read(NOBLOCK)
                if (
                    not isinstance(each, protocol.Stretch)
                    or each.lost
                    or each.is_deaf != first.is_deaf
                ):
                    self._waiting.append((each, more))
                    break
                last, notice = each, each.notice or notice
                placed += each.placed
                parts.append((each.n, more))
        if len(parts) == 1:
            return first, samples
        whole = None
        if any(each is not None for _, each in parts):
            whole = np.concatenate(
                [np.zeros(size, np.complex64) if each is None else each for size, each in parts]
            )
        n = sum(size for size, _ in parts)
        merged = msgspec.structs.replace(last, n=n, lost=first.lost, placed=placed, notice=notice)
        return merged, whole
