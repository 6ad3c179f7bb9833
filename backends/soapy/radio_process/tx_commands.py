"""The daemon's commands to send bursts, and the answers to them."""

import select
import socket
from collections import deque

import msgspec

from backends.base import Samples
from backends.soapy import protocol
from backends.soapy.protocol import SampleRing, TxCommand, TxDone


class TxCommands:
    """The control socket of one thread; `is_over` is set when the daemon has closed its end."""

    def __init__(self, control: socket.socket, ring: SampleRing) -> None:
        self._control = control
        self._ring = ring
        self._poll = select.poll()
        self._poll.register(control, select.POLLIN)
        self.waiting: deque[TxCommand] = deque()
        self.has_begun = False
        self.is_over = False

    def wait(self, seconds: float) -> None:
        """Wait up to `seconds` for a new command."""
        while not self.is_over and self._poll.poll(max(0, round(1e3 * seconds))):
            self._receive()
            seconds = 0.0

    def samples(self, command: TxCommand) -> Samples:
        """The samples of a command; they stay valid until `done`."""
        return self._ring.view(command.at, command.n)

    def done(self, command: TxCommand, outcome: str, start: int) -> None:
        """Answer a command, and free its memory and that of all before it."""
        self._ring.tail = max(self._ring.tail, command.at + command.n)
        self.say(TxDone(command.number, outcome, start, start + command.n))

    def say(self, message: msgspec.Struct) -> None:
        """Send a message to the daemon."""
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
        if isinstance(wish, TxCommand):
            self.waiting.append(wish)
        else:
            self.has_begun = True
