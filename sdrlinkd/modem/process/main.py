"""The modem process: a radio, its receiver and its modulator, for one daemon."""

import asyncio
import contextlib
import gc
import os
import signal
import socket
import sys
import time
from collections.abc import Callable, Sequence
from random import Random

import msgspec
import uvloop

from backends import AbsentError, BackendError, Capabilities, Scheduling
from sdrlinkd.config import backend_of, typed_config
from sdrlinkd.errors import UserError
from sdrlinkd.journal import log_to_stderr
from sdrlinkd.modem.modem import BurstOrder, BurstReport
from sdrlinkd.modem.process import protocol
from sdrlinkd.modem.process.life import BEAT_S
from sdrlinkd.modem.process.loading import Loading
from sdrlinkd.modem.process.modem_here import ModemHere
from sdrlinkd.modem.process.page import Page
from sdrlinkd.modem.process.radios import make_radio
from sdrlinkd.pdulink import AirSeen, Heard

SWITCH_INTERVAL_S = 1e-4
"""With the default, a busy event loop keeps the receiver waiting for 5 ms."""
FULL_STATUS = 5
"""Number of beats after which the status is told, whatever has changed."""
RUNNING = {"samples": 0, "air_cpu_ms": 0}
"""Counters that always change."""
ENDS_S = 2.0
"""Longest time in s in which the stream of a closed radio ends."""


def main() -> None:
    """Serve the daemon whose socket and page are the two descriptors of the command line."""
    # The daemon ends this process, once its last bursts have left: signals to the group do not.
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    # What is loaded stays: to look through it again and again would take a tenth of the time.
    gc.disable()
    control_fd, page_fd = map(int, sys.argv[1:])
    control = socket.socket(fileno=control_fd)
    page = Page(page_fd)
    os.close(page_fd)
    with contextlib.suppress(BrokenPipeError, ConnectionResetError):
        asyncio.Runner(loop_factory=uvloop.new_event_loop).run(_serve(control, page))


async def _serve(control: socket.socket, page: Page) -> None:
    await _Served(control, page).run()


class _Served:
    """The modem of one daemon, and the connection to it."""

    def __init__(self, control: socket.socket, page: Page) -> None:
        self._control = control
        self._page = page
        self._start: asyncio.Future[protocol.Start] = asyncio.get_running_loop().create_future()
        self._modem: ModemHere | None = None
        self._has_begun, self._has_ended = asyncio.Event(), asyncio.Event()
        self._is_over = asyncio.Event()
        self._noted: object = None
        self._room = memoryview(bytearray(protocol.MOST_BYTES))
        self._scheduling: Scheduling | None = None
        self._loading = Loading(lambda text: self._say(protocol.Progress(text)))

    async def run(self) -> None:
        """Open the radio, and serve until the daemon closes its socket."""
        # The receiver's thread waits when the daemon is behind, so the socket is a blocking one.
        loop = asyncio.get_running_loop()
        loop.set_exception_handler(_end_with_traceback)
        loop.add_reader(self._control, self._listen)
        beating = asyncio.ensure_future(self._beat())
        work = asyncio.ensure_future(self._work())
        over = asyncio.ensure_future(self._is_over.wait())
        await asyncio.wait((work, over, beating), return_when=asyncio.FIRST_COMPLETED)
        loop.remove_reader(self._control)
        self._loading.give_up()
        if self._modem is not None:
            # Its stream ends; what it still has to tell is told.
            await self._modem.close()
            if self._has_begun.is_set():
                with contextlib.suppress(TimeoutError):
                    await asyncio.wait_for(self._has_ended.wait(), ENDS_S)
        for task in (work, over):
            task.cancel()
        await asyncio.wait((work, over))
        beating.cancel()
        if not work.cancelled():
            work.result()

    async def _work(self) -> None:
        # The process may be started before its daemon knows what it wants.
        early = asyncio.ensure_future(self._loading.early())
        start = await self._start
        log_to_stderr(start.log_level)
        try:
            await early
            config = typed_config(start.config)
            await self._loading(config.modem.engine)
            gc.freeze()
            gc.enable()
            rng = Random(start.seed)
            backend = backend_of(config)
            self._scheduling = Scheduling(is_urgent=backend is not None and backend.is_hardware)
            radio = make_radio(
                config, start.node_id, rng, start.longest_s, start.patience, os.getppid()
            )
            modem = self._modem = ModemHere(
                config.modem, config.link.pdu_size, radio, start.listens, start.began_s,
                self._loading, _at_once, self._show, lambda: self._page.wakes,
            )  # fmt: skip
            can = await modem.open()
            if can.lockstep:
                raise AbsentError("this air has changed to lock-step; join it again")
            self._tell_status(modem)
            self._say(protocol.Opened(_plain(can)))
            await self._has_begun.wait()
            await modem.run(self)
        except BackendError as error:
            self._say(protocol.Failed.of(error))
        except UserError as error:
            self._say(protocol.Failed.of(BackendError(str(error))))

    # The modem's user. PDUs are delivered on the receiver's thread.

    def delivered(self, heard: Sequence[Heard], end: int) -> None:
        """Pass PDUs on to the daemon."""
        counters = [] if self._modem is None else self._modem.receiver_counters
        self._say(protocol.Delivered(end, list(heard), counters))

    def _observed(self, seen: AirSeen) -> None:
        self._say(protocol.Observed(seen))

    def left(self, report: BurstReport) -> None:
        """Pass the outcome of a burst on to the daemon."""
        self._say(protocol.Left(*report))

    def ended(self, problem: str, is_refusal: bool) -> None:
        """Tell the daemon that the stream has ended."""
        if self._modem is not None:
            self._tell_status(self._modem)
        self._say(protocol.Ended(problem, is_refusal))
        self._has_ended.set()

    def _show(self) -> None:
        modem = self._modem
        if modem is not None and modem.seen is not None:
            self._page.show(modem.seen, modem.sensed, modem.n_samples)

    async def _beat(self) -> None:
        """Show that this process is alive, and what has changed, forever."""
        beats = 0
        while True:
            self._page.beat(time.monotonic())
            if self._scheduling is not None:
                self._scheduling.look()
            if self._modem is not None:
                self._tell_status(self._modem, in_any_case=beats % FULL_STATUS == 0)
            beats += 1
            await asyncio.sleep(BEAT_S)

    def _tell_status(self, modem: ModemHere, *, in_any_case: bool = True) -> None:
        """Tell the status; unless `in_any_case`, only if more than running figures has changed."""
        now = modem.status._replace(engine=self._loading.engine)
        if self._scheduling is not None:
            yields = {"priority_yields": self._scheduling.yields}
            now = now._replace(
                counters={**now.counters, **yields},
                scheduling=self._scheduling.told,
                advice=self._scheduling.advice,
            )
        noted = now.detail, now.trouble, len(now.lines), {**now.counters, **RUNNING}
        if in_any_case or noted != self._noted:
            self._noted = noted
            self._say(protocol.status_of(now))

    def _listen(self) -> None:
        """Handle all messages that the daemon has sent so far."""
        while True:
            try:
                n = self._control.recv_into(self._room, 0, socket.MSG_DONTWAIT)
            except BlockingIOError:
                return
            except OSError:
                n = 0
            if not n:
                self._is_over.set()
                return
            message = protocol.to_modem(self._room[:n])
            if isinstance(message, protocol.Start):
                self._start.set_result(message)
            elif isinstance(message, protocol.Begin):
                self._has_begun.set()
            elif isinstance(message, protocol.Observe):
                if self._modem is not None:
                    self._modem.observe(self._observed if message.is_on else None)
            elif self._modem is not None:
                self._modem.send(BurstOrder(*msgspec.structs.astuple(message)))

    def _say(self, message: msgspec.Struct) -> None:
        with contextlib.suppress(OSError):
            self._control.send(protocol.encode(message))


def _end_with_traceback(loop: asyncio.AbstractEventLoop, context: dict[str, object]) -> None:
    """End the process after a bug: the daemon starts it again, and nothing is half done."""
    loop.default_exception_handler(context)
    sys.stderr.flush()
    os._exit(1)


def _at_once(deliver: Callable[..., object], *arguments: object) -> None:
    """Deliver on the receiver's thread, without a detour over the event loop."""
    deliver(*arguments)


def _plain(can: Capabilities) -> dict[str, object]:
    plain: dict[str, object] = msgspec.to_builtins(can)
    return plain
