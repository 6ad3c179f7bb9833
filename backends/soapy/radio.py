"""A radio behind SoapySDR, which runs in a process of its own."""

import asyncio
import threading
from collections.abc import AsyncIterator, Awaitable
from functools import partial

import msgspec
import numpy as np

from backends.base import (
    AbsentError,
    Capabilities,
    Hear,
    Levels,
    Patience,
    RxBlock,
    Tuning,
    TxBurst,
    TxOutcome,
    TxReport,
)
from backends.feed import BlockFeed
from backends.outstanding import Places, answered
from backends.soapy.child import RadioChild
from backends.soapy.device_status import DeviceStatus
from backends.soapy.in_flight_tx import InFlightTx
from backends.soapy.on_loop import on_loop
from backends.soapy.protocol import (
    Blame,
    CountersReport,
    Failed,
    FromProcess,
    Opened,
    TxDone,
    Waiting,
    ring_sizes,
)
from backends.soapy.rx_assembler import RxAssembler
from backends.soapy.settings import DeviceInfo, SoapySettings

OPEN_S = 60.0
"""Generous, because some devices load their firmware first."""
HUNG_S = 3.0
"""A device that is silent for this long, plus its longest TX window, hangs."""
LOOK_S = 0.1
RETRY_S = 0.25, 2.0


class SoapyRadio:
    """The device that `settings` names; `longest_s` is the longest burst it is given.

    After an unplug or driver crash it retries until the device returns; the missed samples become a
    gap. `patience` says what `open` does without a device.
    """

    def __init__(
        self,
        settings: SoapySettings,
        longest_s: float,
        patience: Patience = Patience.NONE,
    ) -> None:
        self._settings = settings
        self._patience = patience
        self._longest_s = longest_s
        self._assembler = RxAssembler(settings.dc_block)
        self._closing = threading.Event()
        self._child: RadioChild | None = None
        self._listened: RadioChild | None = None
        self._found: DeviceInfo | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._places = Places()
        self._in_flight_tx = InFlightTx()
        self._feed = BlockFeed(self._next_block, "soapy", self._in_flight_tx.is_due, measures=False)
        self._rate_hz = 0.0
        self._yielded = 0
        self._is_over = False
        self._status = DeviceStatus()

    @property
    def capabilities(self) -> Capabilities:
        """What the open device can do with its settings. Raises RuntimeError before it is open."""
        return self._settings.capabilities(self._known)

    @property
    def counters(self) -> dict[str, int]:
        """Counts of all radio processes so far, and of late and underflowed bursts."""
        return {
            **self._status.counters, **self._in_flight_tx.counters, "outages": self._status.outages,
        }  # fmt: skip

    @property
    def detail(self) -> str:
        """The device in one line for people: its identity, and whether it is away."""
        found = self._found
        if found is None:
            return f"{self._settings.device}, not open"
        parts = [
            found.described,
            "" if self._settings.tx_enabled else "tx_enabled = false",
            found.binding,
            self._status.told,
        ]
        return ", ".join(part for part in parts if part)

    @property
    def trouble(self) -> str:
        """Why the device delivers nothing while it is away or not present yet; else empty."""
        return self._status.trouble

    @property
    def levels(self) -> Levels | None:
        """Level of the samples as the device delivers them; None before the first measurement."""
        return self._assembler.meter.levels

    async def open(self, tuning: Tuning) -> None:
        """Start the radio process and open the device. Raises BackendError."""
        self._loop = asyncio.get_running_loop()
        self._rate_hz = tuning.rate_hz
        self._settings = msgspec.structs.replace(
            self._settings, rate_hz=tuning.rate_hz, frequency_hz=tuning.frequency_hz
        )
        try:
            child = self._child = self._make_child(self._patience)
        except OSError as error:
            raise AbsentError(f"cannot start the radio process ({error.strerror})") from None
        answer = await asyncio.to_thread(self._opened, child)
        if isinstance(answer, Opened):
            self._found = answer.found
            self._hear_from(child)
            return
        await self.close()
        if isinstance(answer, Failed):
            raise answer.error()
        raise AbsentError(
            f'soapy.device: got "{self._settings.device}", whose driver has not answered for '
            f"{OPEN_S:g} s; unplug the device and plug it in again, or name another one"
        )

    async def blocks(self, hear: Hear | None = None) -> AsyncIterator[RxBlock]:
        """Yield what the antenna receives. Raises BackendError when a return is refused."""
        self._assembler.is_heard_at_once = hear is not None
        if self._child is not None:
            self._assembler.begin(self._child.rx, self._rate_hz)
            self._child.begin()
        try:
            async for block, is_heard in self._feed.blocks(hear):
                self._yielded = block.index + block.n
                self._in_flight_tx.settle(self._yielded)
                if not is_heard:
                    yield block
        finally:
            self._is_over = True
            self._in_flight_tx.lose()

    def send(self, burst: TxBurst) -> Awaitable[TxReport]:
        """Hand a burst to the radio process; while the device is away, it is lost."""
        child, assembler = self._child, self._assembler
        lost = TxReport(TxOutcome.LOST, burst.start, burst.start)
        is_open = self._found is not None and not self._status.away and not self._is_over
        if child is None or not is_open or not self._settings.tx_enabled:
            return answered(lost)
        start = self._places.place(burst, assembler.next_index + self._least_lead)
        if start is None:
            self._in_flight_tx.counters["late"] += 1
            return answered(lost._replace(outcome=TxOutcome.LATE))
        number = self._in_flight_tx.next_number()
        samples = np.ascontiguousarray(burst.samples, np.complex64)
        latest = None if burst.latest is None else burst.latest - assembler.base
        if not child.send_burst(number, start - assembler.base, samples, latest):
            return answered(lost)
        return self._in_flight_tx.wait(number, start, len(samples))

    async def close(self) -> None:
        """End the radio process and release the device; closing twice is fine."""
        if not self._closing.is_set():
            self._closing.set()
            if self._child is not None:
                self._unlisten(self._child)
                await asyncio.to_thread(self._end)
            self._in_flight_tx.lose()

    @property
    def _known(self) -> DeviceInfo:
        if self._found is None:
            raise RuntimeError("not open")
        return self._found

    @property
    def _least_lead(self) -> int:
        """Lead in samples over the last one heard; a burst that starts earlier cannot be sent."""
        if not self._known.timestamped_tx:
            return 0
        return round(0.5 * self._settings.lead_s * self._rate_hz)

    def _make_child(self, patience: Patience) -> RadioChild:
        rx, tx = ring_sizes(self._rate_hz, self._longest_s, self._settings.lead_s)
        return RadioChild(self._settings, rx, tx, patience)

    def _opened(self, child: RadioChild) -> FromProcess | None:
        """Wait for the outcome of opening; None: the process hangs, or the radio closes."""
        while isinstance(answer := child.next_answer(OPEN_S, self._closing), Waiting):
            self._status.waits(answer.reason)
        self._status.waits_no_more()
        return answer

    def _end(self) -> None:
        self._feed.stop()
        if self._child is not None:
            self._child.end()

    # On the event loop.

    def _listen(self, child: RadioChild) -> None:
        """Handle all messages that the process has sent so far."""
        try:
            while (answer := child.answer()) is not None:
                self._told(child, answer)
        except EOFError:
            # The feed's thread also notices, and waits to learn how the process ended.
            self._unlisten(child)

    def _told(self, child: RadioChild, answer: FromProcess) -> None:
        if isinstance(answer, TxDone):
            self._in_flight_tx.completed(answer, self._assembler.base)
            heard = self._assembler.is_heard_at_once
            self._in_flight_tx.settle(self._assembler.next_index if heard else self._yielded)
        elif isinstance(answer, CountersReport):
            self._status.counted(answer)
        elif isinstance(answer, Failed):
            self._went(child, answer.reason)

    def _unlisten(self, child: RadioChild) -> None:
        if self._listened is child and self._loop is not None:
            self._loop.remove_reader(child.control_fd)
            self._listened = None

    def _went(self, child: RadioChild, reason: str) -> None:
        """Report the pending bursts as lost when the device is gone."""
        self._unlisten(child)
        if self._status.went(reason):
            self._in_flight_tx.lose()

    def _lost(self, child: RadioChild, how: str) -> None:
        """Handle the last messages of an ended process; `how` is the reason if they give none."""
        self._listen(child)
        self._went(child, how)

    def _came_back(self, child: RadioChild, found: DeviceInfo) -> None:
        self._child, self._found = child, found
        self._status.came_back()
        if not self._closing.is_set():
            self._hear_from(child)

    def _hear_from(self, child: RadioChild) -> None:
        if self._loop is not None:
            self._loop.add_reader(child.control_fd, self._listen, child)
            self._listened = child

    # On the feed's thread.

    def _next_block(self) -> RxBlock | None:
        child, assembler = self._child, self._assembler
        while child is not None and not self._closing.is_set():
            try:
                block = assembler.next(child, LOOK_S)
            except EOFError:
                child = self._reopen(child)
                return None if child is None else assembler.gap("the radio was gone", self._known)
            if block is not None:
                return block
            if assembler.quiet_s > HUNG_S + self._settings.longest_tx_s:
                child.give_up()
        return None

    def _reopen(self, lost: RadioChild) -> RadioChild | None:
        """Retry until the device is back; None: closing. Raises RefusalError, BackendError."""
        how = lost.how_it_ended()
        on_loop(self._loop, self._closing, partial(self._lost, lost, how))
        lost.end()
        wait_s, most_s = RETRY_S
        while not self._closing.is_set():
            child = self._make_child(Patience.THERE)
            answer = self._opened(child)
            if isinstance(answer, Opened):
                self._assembler.begin(child.rx, self._rate_hz)
                child.begin()
                on_loop(self._loop, self._closing, partial(self._came_back, child, answer.found))
                return child
            if answer is None:
                child.give_up()
            child.end()
            if isinstance(answer, Failed) and answer.blame is not Blame.ABSENT:
                raise answer.error()
            self._closing.wait(wait_s)
            wait_s = min(2 * wait_s, most_s)
        return None
