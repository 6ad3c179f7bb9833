"""Blocks made on a thread of their own, heard there or taken on the event loop."""

import asyncio
import threading
from collections.abc import AsyncIterator, Callable
from typing import NamedTuple

from backends.base import Hear, Levels, RxBlock
from backends.levels import LevelMeter

# Blocks that may wait for the event loop; past that the thread waits.
MAX_WAITING = 16


class Fed(NamedTuple):
    """A block; whether it was heard where it was made."""

    block: RxBlock
    is_heard: bool


class BlockFeed:
    """Calls `next_block` again and again on a thread, until it returns None or `stop` is called.

    One wake-up of the event loop a block, and no turn of it while a block is made; none at all for
    blocks that were heard, unless `is_due` says of the index after one that something else is to be
    done then. `measures`: how strong what is in the blocks is.
    """

    def __init__(
        self,
        next_block: Callable[[], RxBlock | None],
        name: str,
        is_due: Callable[[int], bool],
        measures: bool = True,
    ) -> None:
        self._next_block = next_block
        self._is_due = is_due
        self._room = threading.Semaphore(MAX_WAITING)
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._work, name=name, daemon=True)
        self._loop: asyncio.AbstractEventLoop | None = None
        self._hear: Hear | None = None
        self._meter = LevelMeter() if measures else None
        self._queue: asyncio.Queue[Fed | BaseException | None] = asyncio.Queue()

    @property
    def levels(self) -> Levels | None:
        """How strong the blocks so far were; None before the first look."""
        return self._meter.levels if self._meter else None

    async def blocks(self, hear: Hear | None) -> AsyncIterator[Fed]:
        """The blocks in order. What `next_block` or `hear` raise is raised here."""
        self._loop, self._hear = asyncio.get_running_loop(), hear
        self._thread.start()
        while (fed := await self._queue.get()) is not None:
            if isinstance(fed, BaseException):
                raise fed
            self._room.release()
            yield fed

    def stop(self) -> None:
        """End the thread and wait for it; stopping twice is fine."""
        self._stopped.set()
        self._room.release()
        if self._thread.is_alive():
            self._thread.join()
        self._queue.put_nowait(None)

    def _work(self) -> None:
        goes_on = True
        while goes_on and not self._stopped.is_set():
            self._room.acquire()
            try:
                goes_on = self._make()
            except Exception as error:
                goes_on = False
                self._hand_over(error)

    def _make(self) -> bool:
        """The next block; False: there is none, or nobody who wants it."""
        block = self._next_block()
        if self._stopped.is_set():
            return False
        if block is None:
            self._hand_over(None)
            return False
        if self._meter and block.samples is not None:
            self._meter.push(block.samples)
        if self._hear is None or not block.n:
            return self._hand_over(Fed(block, is_heard=False))
        # What is due comes first: who hears of the block may act on it.
        if self._is_due(block.index + block.n):
            if not self._hand_over(Fed(block, is_heard=True)):
                return False
        else:
            self._room.release()
        self._hear(block)
        return True

    def _hand_over(self, fed: Fed | BaseException | None) -> bool:
        loop = self._loop
        if loop is None or loop.is_closed():
            return False
        loop.call_soon_threadsafe(self._queue.put_nowait, fed)
        return True
