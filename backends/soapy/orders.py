"""In the radio process: bursts the daemon wants sent, and the answers."""

import select
import socket
from collections import deque

import msgspec

from backends.base import Samples
from backends.soapy import protocol
from backends.soapy.protocol import Left, Order
from backends.soapy.ring import SampleRing


class Orders:
    """The control socket; `is_over` when the daemon has closed its end. Owned by one thread."""

    def __init__(self, control: socket.socket, ring: SampleRing) -> None:
        self._control = control
        self._ring = ring
        self._poll = select.poll()
        self._poll.register(control, select.POLLIN)
        self.waiting: deque[Order] = deque()
        self.has_begun = False
        self.is_over = False

    def wait(self, seconds: float) -> None:
        """Until there is an order that was not there, or for so long."""
        while not self.is_over and self._poll.poll(max(0, round(1e3 * seconds))):
            self._receive()
            seconds = 0.0

    def samples(self, order: Order) -> Samples:
        """Those to be sent; they stay until `done`."""
        return self._ring.view(order.at, order.n)

    def done(self, order: Order, outcome: str, start: int) -> None:
        """Answer it; its memory is free, and that of all before it."""
        self._ring.tail = max(self._ring.tail, order.at + order.n)
        self.say(Left(order.number, outcome, start, start + order.n))

    def say(self, message: msgspec.Struct) -> None:
        """To the daemon, which reads it soon or is gone."""
        try:
            self._control.send(protocol.encode(message))
        except (BrokenPipeError, ConnectionResetError):
            self.is_over = True

    def _receive(self) -> None:
        try:
            data = self._control.recv(protocol.MOST_BYTES)
        except ConnectionResetError:
            data = b""
        if not data:
            self.is_over = True
            return
        wish = protocol.to_process(data)
        if isinstance(wish, Order):
            self.waiting.append(wish)
        else:
            self.has_begun = True
