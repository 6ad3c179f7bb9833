"""Blocks made on a thread of their own, heard there or taken on the event loop."""

import asyncio
import threading
from collections.abc import AsyncIterator, Callable
from typing import NamedTuple

from backends.base import Hear, RxBlock

# Blocks that may wait for the event loop; past that the thread waits.
MAX_WAITING = 16


class Fed(NamedTuple):
    """A block; whether it was heard where it was made."""

    block: RxBlock
    is_heard: bool


class BlockFeed:
    """Calls `next_block` again and again on a thread, until it returns None or `stop` is called.

    One wake-up of the event loop a block, and no turn of it while a block is made; none at all for
    blocks that were heard, unless `is_due` says of one that something else is to be done then.
    """

    def __init__(
        self,
        next_block: Callable[[], RxBlock | None],
        name: str,
        is_due: Callable[[RxBlock], bool],
    ) -> None:
        self._next_block = next_block
        self._is_due = is_due
        self._room = threading.Semaphore(MAX_WAITING)
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._work, name=name, daemon=True)
        self._loop: asyncio.AbstractEventLoop | None = None
        self._hear: Hear | None = None
        self._queue: asyncio.Queue[Fed | BaseException | None] = asyncio.Queue()

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
        while not self._stopped.is_set():
            self._room.acquire()
            try:
                fed: Fed | BaseException | None = self._make()
            except Exception as error:
                fed = error
            if self._stopped.is_set():
                return
            if isinstance(fed, Fed) and fed.is_heard and not self._is_due(fed.block):
                self._room.release()
                continue
            if not self._hand_over(fed) or not isinstance(fed, Fed):
                return

    def _make(self) -> Fed | None:
        block = self._next_block()
        if block is None:
            return None
        is_heard = self._hear is not None and block.n > 0
        if self._hear is not None and is_heard and not self._stopped.is_set():
            self._hear(block)
        return Fed(block, is_heard)

    def _hand_over(self, fed: Fed | BaseException | None) -> bool:
        loop = self._loop
        if loop is None or loop.is_closed():
            return False
        loop.call_soon_threadsafe(self._queue.put_nowait, fed)
        return True
