"""Blocks made on a thread of their own, and heard there or taken on the event loop."""

import asyncio
import threading
from collections.abc import AsyncIterator, Callable
from typing import NamedTuple

from backends.base import Hear, Levels, RxBlock
from backends.levels import LevelMeter

# Number of blocks that may wait for the event loop; beyond that the thread waits.
MAX_WAITING = 16


class Fed(NamedTuple):
    """A block, and whether it was already heard on the thread that made it."""

    block: RxBlock
    is_heard: bool


class BlockFeed:
    """Calls `next_block` repeatedly on a thread, until it returns None or `stop` is called.

    The event loop wakes up once per block, and does not run while a block is made. For a block that
    was heard on the thread it does not wake up at all, unless `is_due` returns true for the index
    after the block: then the loop has other work to do. `measures`: measure the level of the
    blocks.
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
        """Level of the blocks so far; None before the first measurement."""
        return self._meter.levels if self._meter else None

    async def blocks(self, hear: Hear | None) -> AsyncIterator[Fed]:
        """Yield the blocks in order; exceptions of `next_block` and `hear` are raised here."""
        self._loop, self._hear = asyncio.get_running_loop(), hear
        self._thread.start()
        while (fed := await self._queue.get()) is not None:
            if isinstance(fed, BaseException):
                raise fed
            self._room.release()
            yield fed

    def stop(self) -> None:
        """Stop the thread and wait for it; stopping twice is fine."""
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
        """Make the next block; returns False if there is none, or no reader for it."""
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
        # Reports go first: whoever hears the block may act on them.
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
