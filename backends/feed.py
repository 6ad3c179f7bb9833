"""Blocks made on a thread of their own, taken on the event loop."""

import asyncio
import threading
from collections.abc import AsyncIterator, Callable

from backends.base import RxBlock

# Blocks that may wait for the event loop; past that the thread waits.
MAX_WAITING = 16


class BlockFeed:
    """Calls `next_block` again and again on a thread, until it returns None or `stop` is called.

    One wake-up of the event loop a block, and no turn of it while a block is made.
    """

    def __init__(self, next_block: Callable[[], RxBlock | None], name: str) -> None:
        self._next_block = next_block
        self._room = threading.Semaphore(MAX_WAITING)
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._work, name=name, daemon=True)
        self._loop: asyncio.AbstractEventLoop | None = None
        self._queue: asyncio.Queue[RxBlock | BaseException | None] = asyncio.Queue()

    async def blocks(self) -> AsyncIterator[RxBlock]:
        """The blocks in order. What `next_block` raises is raised here."""
        self._loop = asyncio.get_running_loop()
        self._thread.start()
        while (block := await self._queue.get()) is not None:
            if isinstance(block, BaseException):
                raise block
            self._room.release()
            yield block

    def stop(self) -> None:
        """End the thread and wait for it; stopping twice is fine."""
        self._stopped.set()
        self._room.release()
        if self._thread.is_alive():
            self._thread.join()
        self._queue.put_nowait(None)

    def _work(self) -> None:
        block: RxBlock | BaseException | None = None
        while not self._stopped.is_set():
            self._room.acquire()
            try:
                block = self._next_block()
            except Exception as error:
                block = error
            if self._stopped.is_set() or not self._hand_over(block):
                return
            if not isinstance(block, RxBlock):
                return

    def _hand_over(self, block: RxBlock | BaseException | None) -> bool:
        loop = self._loop
        if loop is None or loop.is_closed():
            return False
        loop.call_soon_threadsafe(self._queue.put_nowait, block)
        return True
