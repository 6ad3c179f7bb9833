"""A radio on the simulated air of a hub."""

import asyncio
import contextlib
import threading
from collections import deque
from collections.abc import AsyncIterator, Awaitable

import msgspec
import numpy as np
import zmq

from backends.base import (
    Capabilities,
    Hear,
    Levels,
    Patience,
    RefusalError,
    RxBlock,
    Samples,
    Tuning,
    TxBurst,
    TxOutcome,
    TxReport,
)
from backends.ether import protocol
from backends.ether.antenna import Antenna, Beside
from backends.ether.ear import Piece
from backends.ether.joining import join
from backends.ether.medium import LEAD
from backends.ether.real_time import RealTime
from backends.ether.remote_clock import HubClock
from backends.ether.sockets import NOBLOCK, connect, is_readable, received
from backends.feed import BlockFeed, Fed
from backends.hub_address import HubAddress
from backends.known import ETHER_LEAD_S, ETHER_REMOTE_LEAD_S
from backends.outstanding import answered

ANSWER_MS = 5000
INFINITE = float("inf")
REFUSED_S = 2.0
"""Time in s after which a hub that has refused is asked again."""


class EtherRadio:
    """Joins the hub at `hub` as robot `node`; `who` names it to people.

    When the hub is gone, the stream pauses until the hub returns; the missed samples become a gap.
    `patience` says what `open` does without a hub, or with one that refuses.
    """

    def __init__(
        self, hub: HubAddress, node: int, who: str, patience: Patience = Patience.NONE
    ) -> None:
        self._hub = hub
        self._clock = HubClock(hub.is_remote)
        self._patience = patience
        self._node = node
        self._who = who
        self._context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        self._feed = BlockFeed(self._next_block, "ether", self._is_due)
        self._closing, self._is_idle = threading.Event(), threading.Event()
        self._is_idle.set()
        self._is_welcome = False
        self._welcome: protocol.Welcome
        self._readable = asyncio.Event()
        self._antenna: Antenna | None = None
        self._beside: deque[Beside] = deque()
        self._number = 0
        self._late_seen = 0
        self._is_over = False
        self._real_time: RealTime | None = None
        self._notice = ""
        self.counters = {
            "overflows": 0, "samples_lost": 0, "late": 0, "hub_outages": 0,
            "bursts_slow": 0, "bursts_missed": 0,
        }  # fmt: skip

    @property
    def capabilities(self) -> Capabilities:
        """What this radio can do, according to the hub."""
        paced = self._welcome.paced
        own_s = ETHER_REMOTE_LEAD_S if self._hub.is_remote else ETHER_LEAD_S
        lead_s = own_s if paced else LEAD / self._tuning.rate_hz
        return self._joined.capabilities(paced, lead_s, self._welcome.block_s)

    @property
    def detail(self) -> str:
        """The hub's air, and whether the hub is present, in one line for people."""
        if self._antenna is None:
            return "no hub yet"
        parts = [self._welcome.air, "the hub is gone" if self._is_away else "", self._notice]
        return ", ".join(part for part in parts if part)

    @property
    def trouble(self) -> str:
        """Why nothing comes while the hub is away; else empty."""
        return "it no longer answers; the daemon retries until it is back" if self._is_away else ""

    @property
    def _is_away(self) -> bool:
        return self._real_time is not None and self._real_time.is_away

    @property
    def levels(self) -> Levels | None:
        """Level of the blocks so far; None before the first measurement."""
        return self._feed.levels

    async def open(self, tuning: Tuning) -> None:
        """Join the air. Raises BackendError, also when the hub refuses."""
        self._tuning = tuning
        self._down = connect(self._context, zmq.DEALER, self._hub.air)
        self._up = connect(self._context, zmq.PUSH, self._hub.sky)
        self._is_idle.clear()
        await asyncio.to_thread(self._ask)
        welcome = self._welcome
        self._antenna = Antenna(welcome.radio, welcome.seed, tuning.rate_hz, welcome.jammers)
        if welcome.paced:
            self._real_time = RealTime(
                self._down, self._hello(), welcome, self._antenna, self._clock, self.counters,
                self._closing,
            )  # fmt: skip

    async def blocks(self, hear: Hear | None = None) -> AsyncIterator[RxBlock]:
        """Yield what the hub hands out. Raises BackendError when the hub refuses a return."""
        antenna = self._joined
        # In lock-step every node waits anyway, so a thread would only add cost.
        blocks = self._feed.blocks(hear) if self._real_time else self._blocks_here()
        if self._real_time is None:
            self._say(protocol.Done(token=self._welcome.token, step=0))
        try:
            async for block, is_heard in blocks:
                beside = self._beside.popleft()
                if beside.welcome is not None:
                    # From here on, bursts belong to the new hub.
                    antenna.lose()
                    self._welcome, self._late_seen = beside.welcome, 0
                for placed in beside.placed:
                    self._late_seen += placed.start is None
                    is_late = antenna.placed(placed.number, placed.start, placed.n_samples)
                    self.counters["late"] += is_late
                antenna.settle(block.index + block.n)
                if block.n and not is_heard:
                    yield block
                if beside.step:
                    self._say(protocol.Done(token=self._welcome.token, step=beside.step))
        finally:
            self._is_over = True
            antenna.lose()

    def send(self, burst: TxBurst) -> Awaitable[TxReport]:
        """Hand a burst to the hub; without a hub, it is reported lost when the hub returns."""
        if self._antenna is None or self._is_over or self._closing.is_set():
            return answered(TxReport(TxOutcome.LOST, burst.start, burst.start))
        self._number += 1
        placed = self._antenna.on_air(burst)
        message = protocol.Sent(
            token=self._welcome.token,
            number=self._number,
            start=placed.start,
            latest=placed.latest,
            late_seen=self._late_seen,
        )
        answer = self._antenna.sent(self._number)
        samples = np.ascontiguousarray(burst.samples, np.complex64)
        self._say(message, samples.data.cast("B"))
        return answer

    def relax(self, may_relax: bool) -> None:
        """While nothing is on the air, make longer blocks, if that is allowed."""
        if self._real_time is not None:
            self._real_time.may_relax = may_relax

    async def close(self) -> None:
        """Leave the air; closing twice is fine."""
        if self._closing.is_set():
            return
        self._closing.set()
        # A socket must not be closed while another thread polls it.
        await asyncio.to_thread(self._is_idle.wait)
        if self._is_welcome:
            self._say(protocol.Bye(token=self._welcome.token))
        if self._antenna is not None:
            self._feed.stop()
            self._readable.set()
            asyncio.get_running_loop().remove_reader(int(self._down.fd))
            self._antenna.lose()
        self._context.destroy(linger=100)

    @property
    def _joined(self) -> Antenna:
        if self._antenna is None:
            raise RuntimeError("not open")
        return self._antenna

    def _say(self, message: msgspec.Struct, *more: memoryview) -> None:
        """Send a message to the hub; without a hub, it is dropped."""
        with contextlib.suppress(zmq.Again):
            self._up.send_multipart([protocol.encode(message), *more], NOBLOCK)

    def _hello(self) -> protocol.Hello:
        return protocol.Hello(
            version=protocol.VERSION,
            node=self._node,
            who=self._who,
            rate_hz=self._tuning.rate_hz,
            frequency_hz=self._tuning.frequency_hz,
        )

    def _ask(self) -> None:
        """Join for the first time, before there are blocks; runs in a thread."""
        within_s = INFINITE if self._patience is not Patience.NONE else 1e-3 * ANSWER_MS
        try:
            while True:
                try:
                    self._welcome = join(
                        self._down, self._hello(), self._hub, within_s, self._closing
                    )
                except RefusalError:
                    # Another hub, or another radio there, may change that.
                    if self._patience is not Patience.REPLUGGED or self._closing.wait(REFUSED_S):
                        raise
                else:
                    self._is_welcome = True
                    return
        finally:
            self._is_idle.set()

    def _next_block(self) -> RxBlock | None:
        """Wait for the next block. Runs on the feed's thread."""
        if self._real_time is None or (made := self._real_time.next()) is None:
            return None
        block, beside = made
        self._notice = self._real_time.notice
        self._beside.append(beside)
        return block

    def _is_due(self, end: int) -> bool:
        """On the feed's thread: whether a message came with a block, or a burst has left."""
        beside = self._beside[-1]
        if beside.placed or beside.step or beside.welcome or self._joined.is_due(end):
            return True
        self._beside.pop()
        self._joined.end = end
        return False

    async def _blocks_here(self) -> AsyncIterator[Fed]:
        """In lock-step: read on the event loop itself."""
        loop, readable = asyncio.get_running_loop(), self._readable
        fd = int(self._down.fd)
        loop.add_reader(fd, readable.set)
        try:
            while not self._closing.is_set():
                readable.clear()
                # The descriptor only signals new messages, so check for waiting ones first.
                if not is_readable(self._down):
                    await readable.wait()
                    continue
                message, samples = received(self._down)
                if isinstance(message, protocol.Refused):
                    raise RefusalError(message.reason)
                if isinstance(message, protocol.Stretch):
                    yield Fed(self._receive(message, samples), is_heard=False)
        finally:
            if not self._down.closed:
                loop.remove_reader(fd)

    def _receive(self, message: protocol.Stretch, samples: Samples | None) -> RxBlock:
        self._notice = message.notice or self._notice
        self._beside.append(Beside(message.placed, message.step))
        return self._joined.receive(Piece(message.n, samples, message.is_deaf), 0)
