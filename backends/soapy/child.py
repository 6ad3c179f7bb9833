"""The radio process as the daemon sees it: starts it, talks to it, and ends it in any case."""

import os
import select
import socket
import subprocess
import sys
import threading
import time

import msgspec

from backends.base import Patience, Samples
from backends.soapy import protocol
from backends.soapy.driver_log import DriverLog
from backends.soapy.protocol import (
    Begin,
    Failed,
    FromProcess,
    Open,
    RxChunk,
    SampleRing,
    TxCommand,
    make_shared,
)
from backends.soapy.settings import SoapySettings

END_S = 2.0
"""A process that has not ended this long after it was told to is killed."""
LOOK_S = 0.1
SOCKET_BYTES = 1 << 20


class RadioChild:
    """A radio process; `patience` says how it waits for its device."""

    def __init__(
        self, settings: SoapySettings, rx_samples: int, tx_samples: int, patience: Patience
    ) -> None:
        kind = socket.SOCK_SEQPACKET
        self._control, control = socket.socketpair(socket.AF_UNIX, kind)
        self.control_fd = self._control.fileno()
        """A descriptor that is readable when the process has answered."""
        self._rx_socket, rx_socket = socket.socketpair(socket.AF_UNIX, kind)
        for end in (self._control, control, rx_socket):
            end.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SOCKET_BYTES)
        memory = [make_shared(rx_samples, "rx"), make_shared(tx_samples, "tx")]
        self.rx = SampleRing(memory[0], rx_samples)
        self.tx = SampleRing(memory[1], tx_samples)
        self._driver_log = DriverLog()
        inherited = [control.fileno(), rx_socket.fileno(), *memory]
        self._process = subprocess.Popen(
            [sys.executable, "-m", "backends.soapy.radio_process", *map(str, inherited)],
            stdin=subprocess.DEVNULL,
            stdout=self._driver_log.fd,
            stderr=self._driver_log.fd,
            pass_fds=inherited,
        )
        self._driver_log.begin()
        control.close()
        rx_socket.close()
        for each in memory:
            os.close(each)
        self._poll = select.poll()
        self._poll.register(self._rx_socket, select.POLLIN)
        self._control.send(protocol.encode(Open(settings, rx_samples, tx_samples, patience)))
        self._control.setblocking(False)
        self._tx_at = 0
        self._hangs = False

    def next_answer(self, within_s: float, is_over: threading.Event) -> FromProcess | None:
        """Wait for the process's next message; None: nothing in time, or `is_over` is set.

        If the process has ended, the answer is Failed with the reason.
        """
        poll = select.poll()
        poll.register(self._control, select.POLLIN)
        until = time.monotonic() + within_s
        while not is_over.is_set() and time.monotonic() < until:
            if not poll.poll(1e3 * LOOK_S):
                continue
            try:
                return self.answer()
            except EOFError:
                return Failed(self.how_it_ended())
        return None

    def answer(self) -> FromProcess | None:
        """The process's next message; None: none yet. Raises EOFError when no more can come."""
        try:
            data = self._control.recv(protocol.MOST_BYTES)
        except BlockingIOError:
            return None
        except OSError:
            data = b""
        if not data:
            raise EOFError
        return protocol.from_process(data)

    def begin(self) -> None:
        """Tell the process to start receiving."""
        self._say(Begin())

    def next_chunk(self, timeout_s: float) -> RxChunk | None:
        """The next chunk received, if one comes in time. Raises EOFError when no more can come."""
        if not self._poll.poll(1e3 * timeout_s):
            return None
        try:
            data = self._rx_socket.recv(protocol.RX_CHUNK_BYTES)
        except OSError:
            data = b""
        if not data:
            raise EOFError
        return protocol.unpack_rx_chunk(data)

    def send_burst(self, number: int, start: int, samples: Samples, latest: int | None) -> bool:
        """Send samples as burst `number`; False when the process cannot accept them."""
        n = len(samples)
        at = self.tx.whole(self._tx_at, n)
        if n > self.tx.capacity or at + n - self.tx.tail > self.tx.capacity:
            return False
        self.tx.view(at, n)[:] = samples
        if not self._say(TxCommand(number, start, n, at, latest)):
            return False
        self._tx_at = at + n
        return True

    def give_up(self) -> None:
        """Kill a hanging process."""
        self._hangs = True
        self._process.kill()

    def wait(self) -> None:
        """Wait up to END_S for the process to end; then kill it."""
        try:
            self._process.wait(END_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def end(self) -> None:
        """End the process and free its shared memory; ending twice is fine."""
        self._control.close()
        self.wait()
        self._rx_socket.close()
        for ring in (self.rx, self.tx):
            ring.close()

    def _say(self, message: msgspec.Struct) -> bool:
        try:
            self._control.send(protocol.encode(message))
        except OSError:
            return False
        return True

    def how_it_ended(self) -> str:
        """How the process ended, in words; waits for its end."""
        self.wait()
        code = self._process.returncode
        if self._hangs:
            return "the driver hung"
        if code < 0:
            return f"the driver crashed (signal {-code})"
        last = self._driver_log.last_line() if code else ""
        return f"the radio process ended{f' ({last})' if last else ''}"
