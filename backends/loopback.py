"""A radio whose antenna hears itself, through a simulated channel."""

import asyncio
from collections.abc import AsyncIterator
from concurrent.futures import ThreadPoolExecutor

from backends.air import Channel, Timeline
from backends.base import BackendError, Capabilities, RxBlock, Tuning, TxBurst, TxOutcome, TxReport
from backends.outstanding import Outstanding
from backends.pace import Pace

MAX_BEHIND_S = 0.5


class LoopbackRadio:
    """Sends to itself. `paced` by the clock, or as fast as blocks are taken.

    Without `hear_self` only the front end's noise is received.
    """

    def __init__(
        self, channel: Channel, block_s: float, paced: bool = True, hear_self: bool = True
    ) -> None:
        try:
            self._path = channel.make_path()
        except ValueError as error:
            raise BackendError(str(error)) from None
        self._front_end = channel.make_front_end()
        self._profile = channel.path.profile
        self._block_s = block_s
        self._paced = paced
        self._hear_self = hear_self
        self._timeline = Timeline()
        self._outstanding = Outstanding()
        self._next = 0
        self._closed = asyncio.Event()
        self._closed.set()
        self._thread = ThreadPoolExecutor(1, "loopback")
        self.counters = {"overflows": 0, "samples_lost": 0, "late": 0}

    @property
    def capabilities(self) -> Capabilities:
        """Both directions at once, indices exact."""
        return Capabilities(
            receives=True, transmits=True, full_duplex=True, timestamps=True, paced=self._paced
        )

    @property
    def detail(self) -> str:
        """For people."""
        return f"{self._profile} channel" + ("" if self._paced else ", unpaced")

    async def open(self, tuning: Tuning) -> None:
        """Begin at index 0."""
        self._n = max(1, round(self._block_s * tuning.rate_hz))
        self._pace = Pace(tuning.rate_hz, self._paced, MAX_BEHIND_S)
        self._closed.clear()

    async def blocks(self) -> AsyncIterator[RxBlock]:
        """What the antenna hears; when the reader is far behind, what it missed is a gap."""
        loop = asyncio.get_running_loop()
        self._pace.restart()
        while not self._closed.is_set():
            first, n = self._next, self._n
            behind = await self._pace.wait_for(first + n)
            lost = self._pace.overdue(behind)
            if self._closed.is_set():
                return
            self._next += n + lost
            if lost:
                self.counters["overflows"] += 1
                self.counters["samples_lost"] += n + lost
                self._timeline.take(first, n + lost)
                samples = None
            else:
                heard = self._timeline.take(first, n)
                samples = await loop.run_in_executor(self._thread, self._front_end.receive, heard)
            self._outstanding.settle(self._next)
            reason = "the reader was too slow" if lost else ""
            host_ns = self._pace.host_ns(first + n + lost)
            yield RxBlock(first, n + lost, samples, reason, host_ns)

    async def send(self, burst: TxBurst) -> TxReport:
        """Put a burst on the air, unless its first sample should have left already."""
        if self._closed.is_set():
            return TxReport(TxOutcome.LOST, burst.start)
        if burst.start < self._next:
            self.counters["late"] += 1
            return TxReport(TxOutcome.LATE, burst.start)
        offset, samples = self._path.carry(burst.samples)
        if self._hear_self:
            self._timeline.add(burst.start + offset, samples)
        return await self._outstanding.left(burst.start + len(burst.samples))

    async def close(self) -> None:
        """Stop."""
        self._closed.set()
        self._outstanding.lose()
        self._thread.shutdown(wait=False)
