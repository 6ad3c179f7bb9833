"""A modem in a process of its own, as its daemon sees it: starts it, talks to it, and ends it.

The interpreter's lock of the daemon keeps no sample waiting there, and a crash of a driver or of
the modem ends no daemon. A process that has ended, or hangs, is reported as an absent radio: the
daemon then makes a new modem, whose time goes on.
"""

import asyncio
import contextlib
import logging
import os
import socket
import subprocess
import time
from collections.abc import Callable
from typing import NamedTuple

import msgspec

import phy
from backends import AbsentError, BackendError, Capabilities, Patience
from sdrlinkd.config import Config
from sdrlinkd.link import Outcome, Sensed
from sdrlinkd.modem.clock import Seen
from sdrlinkd.modem.modem import BurstOrder, BurstReport, ModemStatus, ModemUser, NoModem
from sdrlinkd.modem.process import life, protocol
from sdrlinkd.modem.process.modem_here import forever
from sdrlinkd.modem.process.page import Page, Shown
from sdrlinkd.pdulink import Observe
from sdrlinkd.spawn import EarlyModem, spawn_modem

END_S = 30.0
"""A process that has not ended this long after it was told to is killed; radios take their time."""
GONE_S = 1.0
"""The same for a process that has closed its socket."""
LOOK_S = 0.01
"""Time between two looks at whether the process has ended."""

log = logging.getLogger("sdrlinkd")


class RadioWanted(NamedTuple):
    """Which radio the process makes, and how; see `protocol.Start`."""

    config: Config
    node_id: int
    seed: int
    longest_s: float
    patience: Patience


class ModemProcess:
    """A modem process with the radio that is `wanted`.

    `listens`: whether the receiver senses if the channel is busy. `began_s`: start of the stream's
    time on the monotonic clock; None: time starts with the samples. `progress` gets a text while
    the modem is being compiled, at the end an empty one. `early` may hold a process already.
    """

    def __init__(
        self,
        wanted: RadioWanted,
        listens: bool,
        began_s: float | None,
        progress: Callable[[str], None] = lambda _: None,
        early: EarlyModem | None = None,
    ) -> None:
        self._wanted = wanted
        self._listens = listens
        self._began_s = began_s
        self._progress = progress
        self._early = early or EarlyModem()
        self._process: subprocess.Popen[bytes] | None = None
        self._socket: socket.socket | None = None
        self._page: Page | None = None
        self._last: Shown | None = None
        self._status = NoModem.status
        self._receiver_counters: dict[str, int] = {}
        self._opened: asyncio.Future[Capabilities] | None = None
        self._over: asyncio.Future[None] | None = None
        self._user: ModemUser | None = None
        self._observe: Observe | None = None
        self._hangs = self._is_closing = False
        # Received into, as a new buffer of the largest size for each message would cost more.
        self._room = memoryview(bytearray(protocol.MOST_BYTES))

    @property
    def wakes(self) -> bool:
        """Whether `delivered` is called for every block, even without PDUs."""
        return self._page is not None and self._page.wakes

    @wakes.setter
    def wakes(self, value: bool) -> None:
        if self._page is not None and self._page.wakes != value:
            self._page.wakes = value

    @property
    def seen(self) -> Seen | None:
        """The last block; None: no block yet."""
        last = self._read()
        return None if last is None else last.seen

    @property
    def sensed(self) -> Sensed:
        """The state of the channel after the last block."""
        last = self._read()
        return Sensed(until=0.0) if last is None else last.sensed

    @property
    def trouble(self) -> str:
        """Why the radio delivers nothing now, if it knows."""
        return self._status.trouble

    @property
    def status(self) -> ModemStatus:
        """Radio, counters and load; running figures are half a second old at most."""
        told, last = self._status, self._read()
        counters = {**told.counters, **self._receiver_counters}
        if last is not None:
            counters["samples"] = last.n_samples
        return told._replace(counters=counters)

    async def open(self) -> Capabilities:
        """Start the process and open the radio there. Raises BackendError."""
        loop = asyncio.get_running_loop()
        self._opened, self._over = loop.create_future(), loop.create_future()
        try:
            control = self._start()
        except OSError as error:
            raise AbsentError(f"cannot start the modem process ({error.strerror})") from None
        loop.add_reader(control, self._listen, control)
        return await self._opened

    async def run(self, user: ModemUser) -> None:
        """Receive and send until cancelled. Raises AbsentError when the process ends or hangs."""
        if self._over is None:
            raise RuntimeError("run before open")
        self._user = user
        self._say(protocol.Begin())
        signs = life.SignsOfLife()
        while not self._over.done():
            await asyncio.wait((self._over,), timeout=life.WATCH_S)
            if self._page is not None and signs.are_missing(self._page.beat_s):
                self._hangs = True
                self._kill()
        self._over.result()
        await forever()

    def send(self, order: BurstOrder) -> None:
        """Send a burst; `left` follows, or the end of the process."""
        try:
            self._say(protocol.order_of(order))
        except BlockingIOError:
            # The process does not read what it is sent.
            lost = BurstReport(order.number, Outcome.LOST, order.start)
            if self._user is not None:
                asyncio.get_running_loop().call_soon(self._user.left, lost)

    def observe(self, tell: Observe | None) -> None:
        """Call `tell` with what is on the air, some times a second; None: no longer."""
        was_on, self._observe = self._observe is not None, tell
        if was_on != (tell is not None):
            with contextlib.suppress(BlockingIOError):
                self._say(protocol.Observe(tell is not None))

    async def close(self) -> None:
        """Close the radio; bursts that have not left are not reported. Closing twice is fine."""
        self._is_closing = True
        if self._socket is not None:
            # The process closes its radio then, tells the end of its stream, and ends.
            with contextlib.suppress(OSError):
                self._socket.shutdown(socket.SHUT_WR)
        await self._end()
        if self._socket is not None:
            self._listen(self._socket)
            self._hang_up()
        if self._opened is not None:
            self._opened.cancel()

    def _start(self) -> socket.socket:
        spawned = self._early.take() or spawn_modem()
        self._process, self._socket = spawned.process, spawned.control
        self._page = Page(spawned.page)
        os.close(spawned.page)
        wanted = self._wanted
        config = msgspec.to_builtins(wanted.config)
        self._say(
            protocol.Start(
                config, wanted.node_id, wanted.seed, wanted.longest_s, wanted.patience,
                self._began_s, self._listens, log.getEffectiveLevel(),
            )
        )  # fmt: skip
        return spawned.control

    def _read(self) -> Shown | None:
        if self._page is not None:
            self._last = self._page.read()
        return self._last

    def _say(self, message: msgspec.Struct) -> None:
        """Send a message. Raises BlockingIOError when the process has too many to read.

        That it has ended shows when it is listened to.
        """
        if self._socket is not None:
            with contextlib.suppress(BrokenPipeError, ConnectionResetError):
                self._socket.send(protocol.encode(message))

    def _listen(self, control: socket.socket) -> None:
        """Handle all messages that the process has sent so far."""
        while self._socket is control:
            try:
                n = control.recv_into(self._room)
            except BlockingIOError:
                return
            except OSError:
                n = 0
            if not n:
                self._hang_up()
                return
            self._told(protocol.from_modem(self._room[:n]))

    def _hang_up(self) -> None:
        """Note that no more messages come."""
        if self._socket is not None:
            asyncio.get_running_loop().remove_reader(self._socket)
            self._socket.close()
            self._socket = None
            if self._is_closing and self._over is not None and not self._over.done():
                self._over.set_result(None)
            elif not self._is_closing:
                self._ended(AbsentError(self._how_it_ended()))

    def _told(self, message: protocol.FromModem) -> None:
        user, opened = self._user, self._opened
        if isinstance(message, protocol.Delivered):
            self._receiver_counters = dict(zip(phy.COUNTERS, message.counters, strict=True))
            if user is not None:
                user.delivered(message.heard, message.end)
        elif isinstance(message, protocol.Left):
            if user is not None:
                user.left(BurstReport(*msgspec.structs.astuple(message)))
        elif isinstance(message, protocol.Status):
            self._status = ModemStatus(*msgspec.structs.astuple(message))
        elif isinstance(message, protocol.Observed):
            if self._observe is not None:
                self._observe(message.seen)
        elif isinstance(message, protocol.Ended):
            if user is not None:
                user.ended(message.problem, message.is_refusal)
        elif isinstance(message, protocol.Progress):
            self._progress(message.text)
        elif isinstance(message, protocol.Opened):
            if opened is not None and not opened.done():
                opened.set_result(msgspec.convert(message.can, Capabilities))
        else:
            self._ended(message.error())

    def _ended(self, error: BackendError) -> None:
        for future in (self._opened, self._over):
            if future is not None and not future.done():
                future.set_exception(error)
                # Nobody may be waiting for this one.
                future.exception()

    async def _end(self) -> None:
        """Wait for the process to end; kill it if it hangs, or takes too long."""
        signs, until_s = life.SignsOfLife(), time.monotonic() + END_S
        while self._process is not None and self._process.poll() is None:
            is_alive = self._page is not None and not signs.are_missing(self._page.beat_s)
            if not is_alive or time.monotonic() > until_s:
                self._kill()
            await asyncio.sleep(LOOK_S)

    def _how_it_ended(self) -> str:
        """How a process ended that has closed its socket, in words."""
        if self._process is not None:
            try:
                self._process.wait(GONE_S)
            except subprocess.TimeoutExpired:
                self._kill()
                self._process.wait()
        code = 0 if self._process is None else self._process.returncode
        if self._hangs:
            how = "hung and was ended"
        elif code < 0:
            how = f"ended by signal {-code}"
        else:
            how = f"ended with exit code {code}"
        return f"the modem process {how}; it is started again"

    def _kill(self) -> None:
        if self._process is not None:
            self._process.kill()
