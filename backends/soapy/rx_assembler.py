"""Assembles what radio processes receive into blocks on one index that outlives each process."""

import time
from collections import deque

from backends.base import SENDING, RxBlock
from backends.dc import DcBlocker
from backends.levels import LevelMeter
from backends.soapy.child import RadioChild
from backends.soapy.protocol import GapReason, RxChunk, SampleRing
from backends.soapy.settings import DeviceInfo

REASONS = {
    GapReason.OVERFLOW: "the radio lost samples",
    GapReason.SENDING: SENDING,
    GapReason.RESTART: "the radio was restarted",
}
SLOW = "the daemon was too slow"


class RxAssembler:
    """Joins the chunks of all radio processes. Other threads than the feed's only read it.

    If blocks are heard on the thread, their samples stay in shared memory until the next request.
    """

    def __init__(self, removes_dc: bool) -> None:
        self._dc = DcBlocker() if removes_dc else None
        self.meter = LevelMeter()
        self._rate_hz = 0.0
        self._done = 0
        self._last_ns = 0
        self._ahead: deque[RxBlock] = deque()
        self.is_heard_at_once = False
        self.next_index = 0
        """Index after the last sample heard."""
        self.base = 0
        """Index of the current process's first sample."""

    def begin(self, ring: SampleRing, rate_hz: float) -> None:
        """Continue with a new process that has opened its device; our clock measures the gap."""
        self._rate_hz, self._done = rate_hz, ring.tail
        now_ns = time.monotonic_ns()
        if self._last_ns:
            self.base = self.next_index + max(1, round(1e-9 * (now_ns - self._last_ns) * rate_hz))
        self._last_ns = now_ns

    @property
    def quiet_s(self) -> float:
        """Time in s since the last chunk."""
        return 1e-9 * (time.monotonic_ns() - self._last_ns)

    def next(self, child: RadioChild, within_s: float) -> RxBlock | None:
        """The next block, if one comes in time. Raises EOFError when no more can come."""
        if self._ahead:
            return self._ahead.popleft()
        child.rx.tail = self._done
        chunk = child.next_chunk(within_s)
        if chunk is None:
            return None
        index, begin = chunk.first + self.base, self.next_index
        block = self._block(child, chunk, index)
        self.next_index, self._last_ns = index + chunk.n, time.monotonic_ns()
        if index <= begin:
            return block
        # The process had no room for the samples in between.
        self._ahead.append(block)
        return RxBlock(begin, index - begin, None, SLOW, chunk.host_ns)

    def gap(self, reason: str, found: DeviceInfo) -> RxBlock:
        """The gap up to the first sample of the current process."""
        begin, self.next_index = self.next_index, self.base
        unsure = round(found.receives_in_s * self._rate_hz)
        return RxBlock(begin, self.base - begin, None, reason, self._last_ns, unsure)

    def _block(self, child: RadioChild, chunk: RxChunk, index: int) -> RxBlock:
        n, host_ns, unsure = chunk.n, chunk.host_ns, chunk.uncertainty
        if chunk.gap_reason != GapReason.NONE:
            return RxBlock(index, n, None, REASONS[GapReason(chunk.gap_reason)], host_ns, unsure)
        samples = child.rx.view(chunk.at, n)
        self.meter.push(samples)
        self._done = chunk.at + n
        if self._dc is not None:
            samples = self._dc.push(samples)
        elif not self.is_heard_at_once:
            samples = samples.copy()
        return RxBlock(index, n, samples, "", host_ns, unsure)
