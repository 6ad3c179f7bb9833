"""Runs the receiver: on the radio's thread, on its own thread or, in lock-step, synchronously."""

import asyncio
import queue
import threading
from collections.abc import Callable, Sequence
from typing import Protocol

import phy
from backends import RxBlock
from sdrlinkd.modem.process.load import LoadMeter
from sdrlinkd.modem.process.sensing_receiver import SensingReceiver

# Most blocks that wait for the receiver.
MAX_BLOCKS = 16

Deliver = Callable[[Sequence[phy.PduHeard], int], None]
Call = Callable[..., object]


class Demodulation(Protocol):
    """Demodulates blocks; passes PDUs, and the index after their block, to `deliver`."""

    load: LoadMeter
    wakes: bool
    """Whether to deliver after every block, even without PDUs."""

    def hear(self, block: RxBlock) -> None:
        """Demodulate a block now, on the calling thread."""

    async def put(self, block: RxBlock) -> None:
        """Hand over a block; may wait while too many blocks are queued."""

    async def finish(self) -> None:
        """End the stream, and deliver the PDUs of its last samples."""

    def stop(self) -> None:
        """Stop at once, even if blocks are queued."""


def _pdus(events: Sequence[phy.Event]) -> list[phy.PduHeard]:
    return [event for event in events if isinstance(event, phy.PduHeard)]


class ReceiverHere:
    """Demodulates within `put`, for lock-step, where nothing proceeds until a block is done."""

    def __init__(self, receiving: SensingReceiver, rate_hz: float, deliver: Deliver) -> None:
        self._receiving = receiving
        self._rate_hz = rate_hz
        self._deliver = deliver
        self.load = LoadMeter()
        self.wakes = True

    async def put(self, block: RxBlock) -> None:
        """Demodulate a block, and process everything that follows from it."""
        self.hear(block)

    def hear(self, block: RxBlock) -> None:
        """Demodulate a block, and deliver the PDUs that it completes."""
        began = self.load.begin()
        events = self._receiving.hear(block)
        self.load.end(began, block.n / self._rate_hz)
        self._deliver(_pdus(events), block.index + block.n)

    async def finish(self) -> None:
        """Deliver the PDUs of the last samples."""
        end = self._receiving.next_index
        self._deliver(_pdus(self._receiving.flush()), end)

    def stop(self) -> None:
        """There is no thread to stop."""


class ReceiverThread:
    """Demodulates on a thread, and calls `deliver` by `call`: on the event loop, or at once.

    `deliver` is called when there are PDUs, or for every block while `wakes` is set. A radio that
    calls `hear` has its blocks demodulated on its own thread. Blocks of other radios are passed to
    `put` and demodulated on our thread. All blocks of a stream take the same way.
    """

    def __init__(
        self,
        receiving: SensingReceiver,
        rate_hz: float,
        deliver: Deliver,
        wakes: bool,
        call: Call | None = None,
    ) -> None:
        self._receiving = receiving
        self._rate_hz = rate_hz
        self._deliver = deliver
        self._call_with = call or self._on_loop
        self.wakes = wakes
        self._blocks: queue.SimpleQueue[RxBlock | None] = queue.SimpleQueue()
        self._loop = asyncio.get_running_loop()
        self._has_room = asyncio.Event()
        self._is_waited_for = self._is_stopped = False
        self._ended = asyncio.Event()
        self.load = LoadMeter()
        self._thread = threading.Thread(target=self._work, name="phy-rx", daemon=True)

    def hear(self, block: RxBlock) -> None:
        """Demodulate a block on the calling thread."""
        began = self.load.begin()
        pdus = _pdus(self._receiving.hear(block))
        if block.samples is not None:
            self.load.end(began, block.n / self._rate_hz)
        if pdus or self.wakes:
            self._call_with(self._deliver, pdus, block.index + block.n)

    async def put(self, block: RxBlock) -> None:
        """Hand over a block; waits while too many blocks are queued."""
        self._begin()
        while self._blocks.qsize() >= MAX_BLOCKS and not self._is_stopped:
            self._has_room.clear()
            self._is_waited_for = True
            # The thread may have made room before it saw that this task waits.
            if self._blocks.qsize() > MAX_BLOCKS // 2:
                await self._has_room.wait()
        self._blocks.put(block)

    async def finish(self) -> None:
        """End the stream and the thread, and deliver the PDUs of the last samples."""
        self._begin()
        self._blocks.put(None)
        await self._ended.wait()

    def stop(self) -> None:
        """End the thread, even if blocks are queued, and release a waiting `put`."""
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
            # To avoid a wake-up per block, a waiting `put` resumes once half of the room is free.
            if self._is_waited_for and self._blocks.qsize() <= MAX_BLOCKS // 2:
                self._is_waited_for = False
                self._on_loop(self._has_room.set)
        end = self._receiving.next_index
        self._call_with(self._deliver, _pdus(self._receiving.flush()), end)
        self._on_loop(self._ended.set)

    def _on_loop(self, what: Callable[..., None], *arguments: object) -> None:
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(what, *arguments)
