"""Bursts that were handed over and whose last sample has not left yet."""

import asyncio
from collections.abc import AsyncIterator

from backends.base import Hear, RxBlock, TxBurst, TxOutcome, TxReport
from backends.feed import BlockFeed

NEVER = 1 << 62
GAP = 32
"""Samples of silence after a burst, for its echoes."""


def answered(report: TxReport) -> asyncio.Future[TxReport]:
    """A future that already holds the report."""
    answer: asyncio.Future[TxReport] = asyncio.get_running_loop().create_future()
    answer.set_result(report)
    return answer


class Places:
    """Places bursts one after another, so that none overlap."""

    def __init__(self) -> None:
        self._free_from = 0

    def place(self, burst: TxBurst, earliest: int) -> int | None:
        """Return the start of a burst, `earliest` or later; None: too late."""
        start = max(burst.start, earliest, self._free_from)
        if burst.latest is not None and start > burst.latest:
            return None
        self._free_from = start + len(burst.samples) + GAP
        return start


class Outstanding(Places):
    """Places bursts, and reports each when the stream has passed its end."""

    def __init__(self) -> None:
        super().__init__()
        self._waiting: list[tuple[TxReport, asyncio.Future[TxReport]]] = []
        self._is_over = False
        self._first_end = NEVER

    def left(self, start: int, n_samples: int) -> asyncio.Future[TxReport]:
        """Register a burst; its report comes when its last sample has left, or all is lost."""
        report = TxReport(TxOutcome.SENT, start, start + n_samples)
        if self._is_over:
            return answered(report._replace(outcome=TxOutcome.LOST))
        answer: asyncio.Future[TxReport] = asyncio.get_running_loop().create_future()
        self._waiting.append((report, answer))
        self._first_end = min(self._first_end, report.end)
        return answer

    async def blocks(self, feed: BlockFeed, hear: Hear | None) -> AsyncIterator[RxBlock]:
        """Yield the feed's blocks; report the bursts that have left, and at the end all as lost."""
        try:
            async for block, is_heard in feed.blocks(hear):
                self.settle(block.index + block.n)
                if not is_heard:
                    yield block
        finally:
            self.lose()

    def short_of(self, first: int, n: int) -> int:
        """Length of a block of at most `n` samples that ends when the burst on the air has arrived.

        May be called from any thread.
        """
        end = self._first_end + GAP
        return end - first if first < end < first + n else n

    def is_due(self, index: int) -> bool:
        """Whether `settle` would report a burst; may be called from any thread."""
        return self._first_end <= index

    def settle(self, index: int) -> None:
        """Report the bursts that ended before `index`: every sample before it has left."""
        if not self.is_due(index):
            return
        left = [each for each in self._waiting if each[0].end <= index]
        self._waiting = [each for each in self._waiting if each[0].end > index]
        self._first_end = min((each.end for each, _ in self._waiting), default=NEVER)
        for report, answer in left:
            if not answer.done():
                answer.set_result(report)

    def lose(self) -> None:
        """Report all bursts as lost, now and later ones: nothing more will leave."""
        self._is_over = True
        waiting, self._waiting = self._waiting, []
        for report, answer in waiting:
            if not answer.done():
                answer.set_result(report._replace(outcome=TxOutcome.LOST))
