"""A radio on the simulated air of a hub."""

import asyncio
import contextlib
import threading
import time
from collections import deque
from collections.abc import AsyncIterator, Awaitable
from typing import NamedTuple

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
from backends.ether.antenna import Antenna
from backends.ether.downlink import Downlink
from backends.ether.joining import join
from backends.ether.medium import LEAD, Piece
from backends.ether.remote_clock import HubClock
from backends.ether.sockets import NOBLOCK, connect
from backends.feed import BlockFeed, Fed
from backends.hub_address import HubAddress
from backends.known import ETHER_LEAD_S, ETHER_REMOTE_LEAD_S
from backends.outstanding import answered

ANSWER_MS = 5000
# A paced hub that is silent for this long is gone; it is then queried at this interval.
QUIET_MS = 500
INFINITE = float("inf")


class _Beside(NamedTuple):
    """What came together with a block; the event loop reads it together with that block."""

    placed: list[protocol.Placed]
    step: int
    welcome: protocol.Welcome | None = None


class EtherRadio:
    """Joins the hub at `hub` as robot `node`; `who` names it to people.

    When the hub is gone, the stream pauses until the hub returns; the missed samples become a gap.
    `patience` says what `open` does without a hub.
    """

    def __init__(
        self, hub: HubAddress, node: int, who: str, patience: Patience = Patience.NONE
    ) -> None:
        self._hub = hub
        self._clock = HubClock(hub.is_remote)
        self._waits = patience is not Patience.NONE
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
        self._beside: deque[_Beside] = deque()
        self._number = 0
        self._late_seen = 0
        self._is_over = False
        self._has_asked = False
        self._last_host_ns = 0
        self._is_away = False
        self._notice = ""
        self.counters = {"overflows": 0, "samples_lost": 0, "late": 0, "hub_outages": 0}

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
    def levels(self) -> Levels | None:
        """Level of the blocks so far; None before the first measurement."""
        return self._feed.levels

    async def open(self, tuning: Tuning) -> None:
        """Join the air. Raises BackendError, also when the hub refuses."""
        self._tuning = tuning
        self._down = connect(self._context, zmq.DEALER, self._hub.air)
        self._downlink = Downlink(self._down)
        self._up = connect(self._context, zmq.PUSH, self._hub.sky)
        self._is_idle.clear()
        await asyncio.to_thread(self._ask)
        self._down.setsockopt(zmq.RCVTIMEO, QUIET_MS)
        self._antenna = Antenna(self._welcome.radio, self._welcome.seed, tuning.rate_hz)

    async def blocks(self, hear: Hear | None = None) -> AsyncIterator[RxBlock]:
        """Yield what the hub hands out. Raises BackendError when the hub refuses a return."""
        antenna = self._joined
        # In lock-step every node waits anyway, so a thread would only add cost.
        blocks = self._feed.blocks(hear) if self._welcome.paced else self._blocks_here()
        if not self._welcome.paced:
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
        within_s = INFINITE if self._waits else 1e-3 * ANSWER_MS
        try:
            self._welcome = join(self._down, self._hello(), self._hub, within_s, self._closing)
            self._is_welcome = True
        finally:
            self._is_idle.set()

    def _next_block(self) -> RxBlock | None:
        """Wait for the next block. Runs on the feed's thread."""
        while not self._closing.is_set():
            try:
                message, samples = self._downlink.next()
            except zmq.Again:
                self._look_for_hub()
                continue
            if isinstance(message, protocol.Stretch):
                self._is_away = False
                return self._receive(*self._downlink.with_more(message, samples))
            if isinstance(message, protocol.Refused):
                raise RefusalError(message.reason)
            if isinstance(message, protocol.Welcome):
                return self._rejoin(message)
            if self._is_away and not self._has_asked and self._node not in message.nodes:
                self._has_asked = True
                with contextlib.suppress(zmq.Again):
                    self._down.send(protocol.encode(self._hello()), NOBLOCK)
        return None

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
                if not self._downlink.has_more():
                    await readable.wait()
                    continue
                message, samples = self._downlink.read(NOBLOCK)
                if isinstance(message, protocol.Refused):
                    raise RefusalError(message.reason)
                if isinstance(message, protocol.Stretch):
                    yield Fed(self._receive(message, samples), is_heard=False)
        finally:
            if not self._down.closed:
                loop.remove_reader(fd)

    def _receive(self, message: protocol.Stretch, samples: Samples | None) -> RxBlock:
        antenna = self._joined
        self._last_host_ns = message.host_ns
        at_ns = self._clock.local_ns(message.host_ns, time.monotonic_ns())
        self._notice = message.notice or self._notice
        if message.lost:
            self.counters["overflows"] += 1
            # These samples are lost too, together with those before them.
            lost = message.lost + message.n
            self.counters["samples_lost"] += lost
            self._beside.append(_Beside(message.placed, message.step))
            return antenna.miss(lost, "the daemon was too slow", at_ns)
        piece = Piece(message.n, samples, message.is_deaf)
        self._beside.append(_Beside(message.placed, message.step))
        return antenna.receive(piece, at_ns)

    def _look_for_hub(self) -> None:
        """Query a silent hub: in lock-step other nodes may be slow, otherwise the hub is gone."""
        if self._welcome.paced and not self._is_away:
            self._is_away = True
            self.counters["hub_outages"] += 1
        self._has_asked = False
        with contextlib.suppress(zmq.Again):
            self._down.send(protocol.encode(protocol.Question()), NOBLOCK)

    def _rejoin(self, welcome: protocol.Welcome) -> RxBlock:
        """Join a hub that has no record of this radio: its sample count restarts."""
        self._is_away = False
        now_ns = welcome.host_ns
        at_ns = self._clock.local_ns(now_ns, time.monotonic_ns())
        away_s = (now_ns - self._last_host_ns) * 1e-9 if welcome.paced else 0.0
        self._beside.append(_Beside([], 0, welcome))
        self._last_host_ns = now_ns
        n = max(1, round(away_s * self._tuning.rate_hz))
        return self._joined.rejoin(n, "the hub was gone", at_ns)
