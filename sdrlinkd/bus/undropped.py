"""Sends what must not be dropped: acknowledgements, announcements and receipts."""

import asyncio
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import zmq

RETRY_S = 0.001
STUCK_S = 1.0
"""Time in s after which a subscriber that does not read loses what is meant for it."""

Frames = Sequence[bytes]


@dataclass(slots=True)
class _Lane:
    waiting: deque[Frames] = field(default_factory=deque)
    moved_at: float = 0.0
    is_stuck: bool = False


class Undropped:
    """Sends on an XPUB socket, and waits while a subscriber's queue is full.

    ZeroMQ drops what does not fit into a full queue. That suits messages, which are numbered, but
    not answers that a client waits for. Order is kept within a lane. A subscriber that does not
    read delays only its own lane, for at most STUCK_S. `used` is called after each use of the
    socket.
    """

    def __init__(
        self,
        loop: asyncio.AbstractEventLoop,
        socket: zmq.Socket[bytes],
        used: Callable[[], None],
    ) -> None:
        self._loop = loop
        self._socket = socket
        self._used = used
        self._lanes: dict[bytes, _Lane] = {}
        """Lanes with a full subscriber's queue, by lane name."""
        self._retry: asyncio.TimerHandle | None = None

    def send(self, name: bytes, frames: Frames) -> None:
        """Send `frames` in lane `name`, now or as soon as there is room."""
        lane = self._lanes.get(name)
        if lane is not None and not lane.is_stuck:
            lane.waiting.append(frames)
        elif self._fits(frames):
            self._lanes.pop(name, None)
        elif lane is not None:
            # A stuck lane is sent like messages: dropped where there is still no room.
            self._socket.send_multipart(frames, zmq.NOBLOCK)
        else:
            self._lanes[name] = _Lane(deque([frames]), time.monotonic())
            if self._retry is None:
                self._retry = self._loop.call_later(RETRY_S, self._send_waiting)
        self._used()

    def close(self, at_most_s: float) -> None:
        """Send what still waits, for at most `at_most_s`."""
        deadline = time.monotonic() + at_most_s
        while self._retry is not None and time.monotonic() < deadline:
            time.sleep(RETRY_S)
            self._send_waiting()
        if self._retry is not None:
            self._retry.cancel()

    def _send_waiting(self) -> None:
        if self._retry is not None:
            self._retry.cancel()
            self._retry = None
        for name, lane in list(self._lanes.items()):
            self._advance(lane)
            if not lane.waiting and not lane.is_stuck:
                del self._lanes[name]
        if any(lane.waiting for lane in self._lanes.values()):
            self._retry = self._loop.call_later(RETRY_S, self._send_waiting)
        self._used()

    def _advance(self, lane: _Lane) -> None:
        now, waiting = time.monotonic(), lane.waiting
        while waiting and self._fits(waiting[0]):
            waiting.popleft()
            lane.moved_at = now
        if now - lane.moved_at > STUCK_S:
            lane.is_stuck = True
            while waiting:
                self._socket.send_multipart(waiting.popleft(), zmq.NOBLOCK)

    def _fits(self, frames: Frames) -> bool:
        """Send `frames` if all their subscribers have room, and return whether they had."""
        # Only for this send: messages must not wait for their slowest consumer.
        self._socket.setsockopt(zmq.XPUB_NODROP, 1)
        try:
            self._socket.send_multipart(frames, zmq.NOBLOCK)
        except zmq.Again:
            return False
        finally:
            self._socket.setsockopt(zmq.XPUB_NODROP, 0)
        return True
