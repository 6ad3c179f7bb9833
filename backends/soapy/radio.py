"""A radio behind SoapySDR, in a process of its own."""

import asyncio
import threading
from collections import Counter
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
from backends.soapy.handed import Handed
from backends.soapy.hearing import Hearing
from backends.soapy.on_loop import on_loop
from backends.soapy.protocol import Blame, Counted, Failed, FromProcess, Left, Opened, Waiting
from backends.soapy.ring import ring_sizes
from backends.soapy.settings import Found, SoapySettings

OPEN_S = 60.0
"""Some devices load their firmware first."""
HUNG_S = 3.0
"""A device that says nothing for so long, beyond what it may send without listening, hangs."""
LOOK_S = 0.1
RETRY_S = 0.25, 2.0


class SoapyRadio:
    """The device that `settings` names; `longest_s` is the longest burst it is given.

    A device that goes away is looked for until it is back; what it missed is a gap. `patience`: of
    `open`, where it is not there.
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
        self._hearing = Hearing(settings.dc_block)
        self._closing = threading.Event()
        self._child: RadioChild | None = None
        self._listened: RadioChild | None = None
        self._found: Found | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._places = Places()
        self._handed = Handed()
        self._feed = BlockFeed(self._next_block, "soapy", self._handed.is_due, measures=False)
        self._rate_hz = 0.0
        self._yielded = 0
        self._is_over = False
        self._away = self._notice = self._waits_for = ""
        self._before: Counter[str] = Counter()
        self._counted: Counter[str] = Counter(overflows=0, samples_lost=0)
        self._outages = 0

    @property
    def capabilities(self) -> Capabilities:
        """As the device is."""
        return self._settings.capabilities(self._known)

    @property
    def counters(self) -> dict[str, int]:
        """Those of all processes so far, and ours."""
        total = Counter(self._before)
        total.update(self._counted)
        return {**total, **self._handed.counters, "outages": self._outages}

    @property
    def detail(self) -> str:
        """For people."""
        found = self._found
        if found is None:
            return f"{self._settings.device}, not open"
        parts = [
            found.described,
            "" if self._settings.tx_enabled else "tx_enabled = false",
            found.binding,
            f"away ({self._away}), looked for until it is back" if self._away else self._notice,
        ]
        return ", ".join(part for part in parts if part)

    @property
    def trouble(self) -> str:
        """While the device is away, or not there yet."""
        if self._away:
            return f"{self._away}; it is looked for until it is back"
        return self._waits_for

    @property
    def levels(self) -> Levels | None:
        """As the device delivers it."""
        return self._hearing.meter.levels

    async def open(self, tuning: Tuning) -> None:
        """Start the process and open the device. Raises BackendError."""
        self._loop = asyncio.get_running_loop()
        self._rate_hz = tuning.rate_hz
        self._settings = msgspec.structs.replace(
            self._settings, rate_hz=tuning.rate_hz, frequency_hz=tuning.frequency_hz
        )
        try:
            child = self._child = self._make_child(self._patience)
        except OSError as error:
            raise AbsentError(f"the radio process cannot be started ({error.strerror})") from None
        answer = await asyncio.to_thread(self._opened, child)
        if isinstance(answer, Opened):
            self._found = answer.found
            self._hear_from(child)
            return
        await self.close()
        if isinstance(answer, Failed):
            raise answer.error()
        raise AbsentError(
            f'soapy.device: got "{self._settings.device}", whose driver does not answer for '
            f"{OPEN_S:g} s; unplug the device and plug it in again, or name another one"
        )

    async def blocks(self, hear: Hear | None = None) -> AsyncIterator[RxBlock]:
        """What the antenna hears. Raises BackendError when the device will not have us any more."""
        self._hearing.is_heard_at_once = hear is not None
        if self._child is not None:
            self._hearing.begin(self._child.rx, self._rate_hz)
            self._child.begin()
        try:
            async for block, is_heard in self._feed.blocks(hear):
                self._yielded = block.index + block.n
                self._handed.settle(self._yielded)
                if not is_heard:
                    yield block
        finally:
            self._is_over = True
            self._handed.lose()

    def send(self, burst: TxBurst) -> Awaitable[TxReport]:
        """Hand a burst to the radio process; while the device is away it is lost."""
        child, hearing = self._child, self._hearing
        lost = TxReport(TxOutcome.LOST, burst.start, burst.start)
        is_open = self._found is not None and not self._away and not self._is_over
        if child is None or not is_open or not self._settings.tx_enabled:
            return answered(lost)
        start = self._places.place(burst, hearing.next_index + self._least_lead)
        if start is None:
            self._handed.counters["late"] += 1
            return answered(lost._replace(outcome=TxOutcome.LATE))
        number = self._handed.next_number()
        samples = np.ascontiguousarray(burst.samples, np.complex64)
        latest = None if burst.latest is None else burst.latest - hearing.base
        if not child.order(number, start - hearing.base, samples, latest):
            return answered(lost)
        return self._handed.wait(number, start, len(samples))

    async def close(self) -> None:
        """Let go of the device."""
        if not self._closing.is_set():
            self._closing.set()
            if self._child is not None:
                self._unlisten(self._child)
                await asyncio.to_thread(self._end)
            self._handed.lose()

    @property
    def _known(self) -> Found:
        if self._found is None:
            raise RuntimeError("not open")
        return self._found

    @property
    def _least_lead(self) -> int:
        """So many samples after the last one heard, nothing can leave any more."""
        if not self._known.keeps_time:
            return 0
        return round(0.5 * self._settings.lead_s * self._rate_hz)

    def _make_child(self, patience: Patience) -> RadioChild:
        rx, tx = ring_sizes(self._rate_hz, self._longest_s, self._settings.lead_s)
        return RadioChild(self._settings, rx, tx, patience)

    def _opened(self, child: RadioChild) -> FromProcess | None:
        """How its opening ends; None: it hangs, or we close. What it waits for is our trouble."""
        while isinstance(answer := child.next_answer(OPEN_S, self._closing), Waiting):
            self._waits_for = answer.reason or self._waits_for
        self._waits_for = ""
        return answer

    def _end(self) -> None:
        self._feed.stop()
        if self._child is not None:
            self._child.end()

    # On the event loop.

    def _listen(self, child: RadioChild) -> None:
        """What the process has said."""
        try:
            while (answer := child.answer()) is not None:
                self._told(child, answer)
        except EOFError:
            # The feed's thread notices, too, and waits until it is known how it ended.
            self._unlisten(child)

    def _told(self, child: RadioChild, answer: FromProcess) -> None:
        if isinstance(answer, Left):
            self._handed.left(answer, self._hearing.base)
            heard = self._hearing.is_heard_at_once
            self._handed.settle(self._hearing.next_index if heard else self._yielded)
        elif isinstance(answer, Counted):
            self._counted, self._notice = Counter(answer.counters), answer.notice
        elif isinstance(answer, Failed):
            self._went(child, answer.reason)

    def _unlisten(self, child: RadioChild) -> None:
        if self._listened is child and self._loop is not None:
            self._loop.remove_reader(child.control_fd)
            self._listened = None

    def _went(self, child: RadioChild, reason: str) -> None:
        """The device is gone."""
        self._unlisten(child)
        if self._away:
            return
        self._away = reason
        self._outages += 1
        self._before.update(self._counted)
        self._counted.clear()
        self._handed.lose()

    def _lost(self, child: RadioChild, how: str) -> None:
        """It has ended: what it had still to say, and if that does not tell, how."""
        self._listen(child)
        self._went(child, how)

    def _came_back(self, child: RadioChild, found: Found) -> None:
        self._child, self._found, self._away = child, found, ""
        if not self._closing.is_set():
            self._hear_from(child)

    def _hear_from(self, child: RadioChild) -> None:
        if self._loop is not None:
            self._loop.add_reader(child.control_fd, self._listen, child)
            self._listened = child

    # On the feed's thread.

    def _next_block(self) -> RxBlock | None:
        child, hearing = self._child, self._hearing
        while child is not None and not self._closing.is_set():
            try:
                block = hearing.next(child, LOOK_S)
            except EOFError:
                child = self._look_for_it(child)
                return None if child is None else hearing.gap("the radio was away", self._known)
            if block is not None:
                return block
            if hearing.quiet_s > HUNG_S + self._settings.longest_tx_s:
                child.give_up()
        return None

    def _look_for_it(self, lost: RadioChild) -> RadioChild | None:
        """Until the device is back; None: we close before. Raises RefusalError, BackendError."""
        how = lost.how_it_ended()
        on_loop(self._loop, self._closing, partial(self._lost, lost, how))
        lost.end()
        wait_s, most_s = RETRY_S
        while not self._closing.is_set():
            child = self._make_child(Patience.THERE)
            answer = self._opened(child)
            if isinstance(answer, Opened):
                self._hearing.begin(child.rx, self._rate_hz)
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
