"""Where the receiver runs: on the radio's thread, on one of its own, or, in lock-step, at once."""

import asyncio
import queue
import threading
import time
from collections.abc import Callable, Sequence
from typing import Protocol

import phy
from backends import RxBlock
from sdrlinkd.modem.load import LoadMeter
from sdrlinkd.modem.sensing_receiver import SensingReceiver

# Blocks that may wait for the receiver.
MAX_BLOCKS = 16

Deliver = Callable[[Sequence[phy.Event], int], None]


class Demodulation(Protocol):
    """Takes blocks; hands events, and the index after their block, to `deliver`."""

    load: LoadMeter
    wakes: bool
    """Deliver after every block, also when it brought no events."""

    def hear(self, block: RxBlock) -> None:
        """Demodulate a block now, on whatever thread calls."""

    async def put(self, block: RxBlock) -> None:
        """Hand over a block; may wait while too many are waiting already."""

    async def finish(self) -> None:
        """End the stream: deliver what its last samples hold."""

    def stop(self) -> None:
        """End at once, whatever waits."""


class ReceiverHere:
    """Demodulates in `put`: in lock-step nothing goes on until it has."""

    def __init__(self, receiving: SensingReceiver, rate_hz: float, deliver: Deliver) -> None:
        self._receiving = receiving
        self._rate_hz = rate_hz
        self._deliver = deliver
        self.load = LoadMeter()
        self.wakes = True

    async def put(self, block: RxBlock) -> None:
        """Demodulate a block, and do everything that follows from it."""
        self.hear(block)

    def hear(self, block: RxBlock) -> None:
        """Demodulate a block, and deliver what it completes."""
        began = time.thread_time()
        events = self._receiving.hear(block)
        self.load.add(time.thread_time() - began, block.n / self._rate_hz)
        self._deliver(events, block.index + block.n)

    async def finish(self) -> None:
        """Deliver what the last samples hold."""
        end = self._receiving.next_index
        self._deliver(self._receiving.flush(), end)

    def stop(self) -> None:
        """End nothing: there is no thread."""


class ReceiverThread:
    """Demodulates on a thread: `deliver` is called on the event loop.

    It is called when there are events, or while `wakes` is set. `hear` demodulates on the radio's
    thread. What a radio does not bring there is `put`, and demodulated on a thread of our own. A
    stream is heard, or put, as a whole.
    """

    def __init__(
        self, receiving: SensingReceiver, rate_hz: float, deliver: Deliver, wakes: bool
    ) -> None:
        self._receiving = receiving
        self._rate_hz = rate_hz
        self._deliver = deliver
        self.wakes = wakes
        self._blocks: queue.SimpleQueue[RxBlock | None] = queue.SimpleQueue()
        self._loop = asyncio.get_running_loop()
        self._has_room = asyncio.Event()
        self._is_waited_for = self._is_stopped = False
        self._ended = asyncio.Event()
        self.load = LoadMeter()
        self._thread = threading.Thread(target=self._work, name="phy-rx", daemon=True)

    def hear(self, block: RxBlock) -> None:
        """Demodulate a block on the thread that calls."""
        began = time.thread_time()
        events = self._receiving.hear(block)
        if block.samples is not None:
            self.load.add(time.thread_time() - began, block.n / self._rate_hz)
        if events or self.wakes:
            self._call(self._deliver, events, block.index + block.n)

    async def put(self, block: RxBlock) -> None:
        """Hand over a block; waits while too many are waiting already."""
        self._begin()
        while self._blocks.qsize() >= MAX_BLOCKS and not self._is_stopped:
            self._has_room.clear()
            self._is_waited_for = True
            # The thread may have made room before it could see that somebody waits.
            if self._blocks.qsize() > MAX_BLOCKS // 2:
                await self._has_room.wait()
        self._blocks.put(block)

    async def finish(self) -> None:
        """End the stream: deliver what its last samples hold, and end the thread."""
        self._begin()
        self._blocks.put(None)
        await self._ended.wait()

    def stop(self) -> None:
        """End the thread, whatever waits; nobody has to wait for it any more."""
        self._is_stopped = True
        self._blocks.put(None)
        if self._thread.ident:
            self._thread.join()
        self._has_room.set()

    def _begin(self) -> None:
        if not self._thread.ident:
            self._thread.start()

    def _work(self) -> None:
        while (block := self._blocks.get()) is not None:
            self.hear(block)
            # Not for every block: who waits is woken once half of the room is free.
            if self._is_waited_for and self._blocks.qsize() <= MAX_BLOCKS // 2:
                self._is_waited_for = False
                self._call(self._has_room.set)
        end = self._receiving.next_index
        self._call(self._deliver, self._receiving.flush(), end)
        self._call(self._ended.set)

    def _call(self, what: Callable[..., None], *arguments: object) -> None:
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(what, *arguments)
