"""Writes received blocks to a recording, and searches it for bursts while there is time."""

import queue
import threading
import time
from collections.abc import Callable
from dataclasses import replace

from backends import BackendError, RecordingWriter, RxBlock
from sdrlinkd.iq.finder import LEAST, BurstFinder
from sdrlinkd.iq.levels import LevelMeter

LEAST_WAITING = 16


class Keeper:
    """Writes blocks on its own thread, and then searches the written samples for bursts.

    So a slow receiver loses nothing; it only finishes after the recording. `ended` is called on
    that thread when no more blocks are needed: there are `most` samples, or the disk fails. Up to
    `waiting` blocks wait for the disk; after that, the radio has to wait.
    """

    def __init__(
        self,
        writer: RecordingWriter,
        finder: BurstFinder,
        rate_hz: float,
        most: int | None,
        waiting: int,
        ended: Callable[[], None],
    ) -> None:
        self._writer, self._finder = writer, finder
        self._rate_hz, self._most = rate_hz, most
        self._ended = ended
        self._blocks: queue.Queue[RxBlock | None] = queue.Queue(max(LEAST_WAITING, waiting))
        self._base: int | None = None
        self._is_full = self._is_given_up = self._has_all = False
        self._is_behind_gap = True
        self._thread = threading.Thread(target=self._work, name="keeper", daemon=True)
        self.level = LevelMeter(rate_hz)
        self.end = 0
        """Number of samples written, including gaps."""
        self.n_gaps = self.n_lost = 0
        self.problem = ""
        """Why no more can be written; empty if all is well."""
        self.failure: Exception | None = None
        """An unexpected exception that ended the thread, if any."""
        self._thread.start()

    def put(self, block: RxBlock) -> None:
        """Write a block; may wait. Any thread may call it, but only one at a time."""
        if self._is_full:
            return
        if block.samples is not None:
            # The samples may be in memory that the next block overwrites.
            block = replace(block, samples=block.samples.copy())
        self._blocks.put(block)

    def give_up(self) -> None:
        """Stop the search for bursts."""
        self._is_given_up = True

    def finish(self) -> None:
        """Find the remaining bursts and complete the files, after the last block."""
        self._blocks.put(None)
        self._thread.join()

    def _work(self) -> None:
        try:
            while (block := self._next()) is not None:
                self._keep(block)
            while self._look(least=1):
                pass
            self._complete()
        except Exception as error:
            self.failure = error
            self._end()
            while not self._has_all:
                self._has_all = self._blocks.get() is None
        finally:
            self._writer.close()

    def _next(self) -> RxBlock | None:
        while self._blocks.empty() and self._look(LEAST):
            pass
        block = self._blocks.get()
        self._has_all = block is None
        return block

    def _look(self, least: int) -> bool:
        return not self._is_given_up and self._finder.look(self.end, least)

    def _keep(self, block: RxBlock) -> None:
        if self._is_full or (self._base is None and block.samples is None):
            return
        if self._base is None:
            self._base = block.index
        first = block.index - self._base
        n = block.n if self._most is None else min(block.n, self._most - first)
        if n <= 0:
            return
        if block.samples is None:
            self._miss(first, n, block.gap_reason)
        else:
            try:
                self._writer.write(first, block.samples[:n])
            except BackendError as error:
                self.problem = str(error)
                self._end()
                return
            self.level.add(block.samples[:n])
            if self._is_behind_gap:
                self._writer.begin_capture(first, self._began_ns(block))
                self._is_behind_gap = False
        self.end = first + n
        if self.end == self._most:
            self._end()

    def _miss(self, first: int, n: int, reason: str) -> None:
        self._is_behind_gap = True
        self.n_gaps += 1
        self.n_lost += n
        self._finder.miss(first, n, reason)

    def _began_ns(self, block: RxBlock) -> int:
        """Time of a block's first sample in ns since 1970, by this host's clock."""
        age_ns = time.monotonic_ns() - block.host_ns + round(1e9 * block.n / self._rate_hz)
        return time.time_ns() - age_ns

    def _end(self) -> None:
        if not self._is_full:
            self._is_full = True
            self._ended()

    def _complete(self) -> None:
        self._finder.finish(self.end)
        try:
            self._writer.extend_to(self.end)
            self._writer.describe(self._finder.annotations)
        except BackendError as error:
            self.problem = self.problem or str(error)
