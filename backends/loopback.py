"""A radio that receives its own signal, through a simulated channel."""

import threading
from collections.abc import AsyncIterator, Awaitable

import numpy as np

from backends.air import AirCost, Channel, Timeline
from backends.base import (
    Capabilities,
    Hear,
    Levels,
    RxBlock,
    Samples,
    Tuning,
    TxBurst,
    TxOutcome,
    TxReport,
)
from backends.feed import BlockFeed
from backends.outstanding import GAP, Outstanding, answered
from backends.pace import Pace

# A reader further behind than this misses samples; up to here none are lost.
MAX_BEHIND_S = 2.0
# A late reader gets fewer, larger blocks.
MAX_LATE_BLOCKS = 8
LONG_S = 0.01
"""Length of a block in s while nothing is on the air."""


class LoopbackRadio:
    """Sends to itself, either `paced` in real time or as fast as blocks are taken.

    Without `hear_self` it receives only the front end's noise.
    """

    def __init__(
        self, channel: Channel, block_s: float, paced: bool = True, hear_self: bool = True
    ) -> None:
        self._path = channel.make_path()
        self._timeline = Timeline()
        self._front_end = channel.make_front_end()
        self._jammers = channel.make_jammers()
        self._profile = channel.path.profile
        self._block_s = block_s
        self._paced = paced
        self._hear_self = hear_self
        self._outstanding = Outstanding()
        self._feed = BlockFeed(self._next_block, "loopback", self._outstanding.is_due)
        # The next block's index and the bursts on the air must change together.
        self._lock = threading.Lock()
        self._next = 0
        self._may_relax = False
        self._quiet_from = 0
        self._is_open = False
        self.counters = {"overflows": 0, "samples_lost": 0, "late": 0}
        self._cost = AirCost(self.counters)

    @property
    def capabilities(self) -> Capabilities:
        """Both directions at once, exact indices."""
        return Capabilities(
            receives=True,
            transmits=True,
            full_duplex=True,
            timestamps=True,
            paced=self._paced,
            block_s=self._block_s,
            shares_air=False,
        )

    @property
    def detail(self) -> str:
        """The simulated air in one line for people."""
        return f"{self._profile} channel" + ("" if self._paced else ", unpaced")

    @property
    def trouble(self) -> str:
        """Always empty: nothing can be wrong with this radio."""
        return ""

    @property
    def levels(self) -> Levels | None:
        """Level of the blocks so far; None before the first measurement."""
        return self._feed.levels

    async def open(self, tuning: Tuning) -> None:
        """Start at index 0, at the rate of `tuning`."""
        self._n = max(1, round(self._block_s * tuning.rate_hz))
        self._long = max(self._n, round(LONG_S * tuning.rate_hz))
        self._rate_hz = tuning.rate_hz
        self._pace = Pace(tuning.rate_hz, self._paced)
        self._is_open = True

    def blocks(self, hear: Hear | None = None) -> AsyncIterator[RxBlock]:
        """Yield what the antenna receives; a reader that is far behind gets a gap."""
        self._pace.restart()
        return self._outstanding.blocks(self._feed, hear)

    def send(self, burst: TxBurst) -> Awaitable[TxReport]:
        """Put a burst on the air."""
        if not self._is_open:
            return answered(TxReport(TxOutcome.LOST, burst.start, burst.start))
        with self._lock:
            start = self._outstanding.place(burst, self._next + self._path.early)
            if start is None:
                self.counters["late"] += 1
                return answered(TxReport(TxOutcome.LATE, burst.start, burst.start))
            self._quiet_from = start + len(burst.samples) + GAP + self._n
            if self._hear_self:
                self._timeline.add(start, burst.samples, self._path)
        if self._may_relax:
            self._pace.wake()
        return self._outstanding.left(start, len(burst.samples))

    def relax(self, may_relax: bool) -> None:
        """While nothing is on the air, make longer blocks, each up to when a burst is sent."""
        self._may_relax = may_relax and self._paced

    async def close(self) -> None:
        """Stop the feed; pending bursts are lost."""
        if self._is_open:
            self._is_open = False
            self._pace.end()
            self._feed.stop()
        self._outstanding.lose()

    def _next_block(self) -> RxBlock:
        """Make the next block. Runs on the feed's thread."""
        first, n = self._next, self._n
        if self._may_relax and first >= self._quiet_from:
            # A burst ends the wait: what is due by then, in whole blocks of the usual length.
            short = -self._pace.wait_for(first + self._long)
            n = max(n, (self._long - max(0, short)) // n * n)
        elif self._paced:
            n = self._outstanding.short_of(first, n)
        behind = max(0, self._pace.wait_for(first + n))
        samples: Samples | None = None
        reason = ""
        if behind > MAX_BEHIND_S * self._rate_hz:
            n += behind
            reason = "the reader was too slow"
            self.counters["overflows"] += 1
            self.counters["samples_lost"] += n
        else:
            n += min(behind, MAX_LATE_BLOCKS * self._n)
        with self._cost:
            with self._lock:
                heard = self._timeline.take(first, n)
                self._next += n
            if not reason:
                antenna = np.zeros(n, np.complex64) if heard is None else heard
                for jammer in self._jammers:
                    antenna = jammer.add(antenna, first)
                samples = self._front_end.receive(antenna)
        return RxBlock(first, n, samples, reason, self._pace.host_ns(first + n))
