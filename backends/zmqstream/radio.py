"""A radio that is another program: samples over ZeroMQ, both ways."""

import threading
import time
from collections.abc import AsyncIterator, Awaitable

import numpy as np
import zmq

from backends.base import (
    BackendError,
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
from backends.line import Line
from backends.outstanding import Outstanding, answered
from backends.params import ZmqParams
from backends.samples import SAMPLE_TYPES
from backends.zmqstream.sockets import Pattern, Sink, Source, open_sink, open_source

LOOK_MS = 20
QUIET_S = 0.25
"""A paced peer that sends nothing for this long counts as absent."""
WILD = 1e3
"""Samples beyond this are taken as a wrong item type: no radio's samples are so large."""
NOT_THERE = "no samples from the peer"


class ZmqRadio:
    """Sends at `send` and receives at `receive`; GNU Radio's sinks and sources use the same names.

    For every sample received one is sent, `lead_s` ahead, so nothing piles up, whoever sets the
    pace. While a `paced` peer is absent, both directions run in real time.
    """

    def __init__(self, params: ZmqParams, block_s: float) -> None:
        self._endpoints = params.send, params.receive
        self._pattern: Pattern = params.pattern
        self._type = SAMPLE_TYPES[params.format]
        self._block_s, self._lead_s = block_s, params.lead_s
        self._paced = params.paced
        self._context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        self._source: Source | None = None
        self._sink: Sink | None = None
        self._poller = zmq.Poller()
        self._line = Line()
        self._outstanding = Outstanding()
        self._feed = BlockFeed(self._next_block, "zmq", self._outstanding.is_due)
        self._closing = threading.Event()
        # The next sample to send and the bursts on the line must change together.
        self._lock = threading.Lock()
        self._received = self._sent = 0
        self._pieces: list[Samples] = []
        self._have = 0
        self._last_ns = 0
        self._is_open = False
        self._notice, self._is_bad = "", False
        self._gap = 0
        self._unsent = b""
        self.counters = {
            "skips": 0, "samples_lost": 0, "late": 0, "outages": 0, "bad_messages": 0,
            "clipped": 0,
        }  # fmt: skip

    @property
    def capabilities(self) -> Capabilities:
        """What this radio can do. Indices count samples: a loss in the peer goes unnoticed."""
        return Capabilities(
            receives=True,
            transmits=True,
            full_duplex=True,
            timestamps=True,
            paced=self._paced,
            lead_s=self._lead_s + self._block_s,
            block_s=self._block_s,
        )

    @property
    def detail(self) -> str:
        """The two endpoints in one line for people."""
        send, receive = self._endpoints
        kinds = {"push": "PUSH/PULL", "pub": "PUB/SUB", "req": "REQ/REP"}
        text = f"{self._type.name} by {kinds[self._pattern]}, to {send}, from {receive}"
        return f"{text}, {self._notice}" if self._notice else text

    @property
    def trouble(self) -> str:
        """Why nothing comes: the peer sends nothing, or nothing readable; else empty."""
        return self._notice if self._is_bad or self._notice == NOT_THERE else ""

    @property
    def levels(self) -> Levels | None:
        """Level of the blocks so far; None before the first measurement."""
        return self._feed.levels

    async def open(self, tuning: Tuning) -> None:
        """Open the sockets, at the modem's rate. Raises BackendError."""
        send, receive = self._endpoints
        rate = tuning.rate_hz
        self._rate_hz = rate
        self._n = max(1, round(self._block_s * rate))
        self._lead = max(self._n, round(self._lead_s * rate))
        self._sink = open_sink(self._context, self._pattern, send, 2 + 2 * self._lead // self._n)
        self._source = open_source(self._context, self._pattern, receive)
        self._poller.register(self._source.socket, zmq.POLLIN)
        if self._pattern == "req":
            self._poller.register(self._sink.socket, zmq.POLLIN)
        self._is_open = True

    def blocks(self, hear: Hear | None = None) -> AsyncIterator[RxBlock]:
        """Yield the samples that the peer sends."""
        self._last_ns = time.monotonic_ns()
        return self._outstanding.blocks(self._feed, hear)

    def send(self, burst: TxBurst) -> Awaitable[TxReport]:
        """Put a burst on the line of samples to send."""
        if not self._is_open:
            return answered(TxReport(TxOutcome.LOST, burst.start, burst.start))
        with self._lock:
            start = self._outstanding.place(burst, self._sent)
            if start is None:
                self.counters["late"] += 1
                return answered(TxReport(TxOutcome.LATE, burst.start, burst.start))
            self._line.lay(start, burst.samples)
        return self._outstanding.left(start, len(burst.samples))

    async def close(self) -> None:
        """Close the sockets; closing twice is fine."""
        if self._is_open:
            self._is_open = False
            self._closing.set()
            self._feed.stop()
        self._context.destroy(linger=0)
        self._outstanding.lose()

    # On the feed's thread.

    def _next_block(self) -> RxBlock | None:
        source, sink = self._source, self._sink
        if source is None or sink is None:
            raise BackendError("blocks before open")
        while not self._closing.is_set():
            self._emit(sink)
            if self._have >= self._n:
                return self._block(self._have - self._have % self._n)
            if self._gap:
                # The samples before the gap come first.
                return self._block(self._have) if self._have else self._missing()
            data = source.next()
            if data is not None:
                self._take(data)
            elif not self._poller.poll(LOOK_MS):
                self._wait()
        return None

    def _take(self, data: bytes) -> None:
        """Take the samples of a message; an unreadable message becomes a gap of the same length."""
        self._last_ns = time.monotonic_ns()
        if len(data) % self._type.size:
            self._refuse(
                len(data) // self._type.size,
                f"messages of {len(data)} B are not whole {self._type.name} samples of "
                f"{self._type.size} B: the peer sends a different item type; set zmq.format",
            )
            return
        samples = self._type.decode(data)
        parts = samples.view(np.float32)
        # Written with `not` to catch NaN, too.
        if len(parts) and not max(parts.max(), -parts.min()) < WILD:
            self._refuse(
                len(samples),
                f"samples beyond ±{WILD:g}, or not numbers: the peer does not send "
                f"{self._type.name}; set zmq.format",
            )
            return
        self._is_bad = False
        if self._notice == NOT_THERE:
            self._notice = ""
        self._pieces.append(samples)
        self._have += len(samples)

    def _refuse(self, n: int, notice: str) -> None:
        self.counters["bad_messages"] += 1
        self._notice, self._is_bad = notice, True
        self._gap += max(1, n)

    def _block(self, n: int) -> RxBlock:
        """Make one block of the first `n` waiting samples: a late reader gets larger blocks."""
        whole = np.concatenate(self._pieces)
        self._pieces, self._have = [whole[n:]] if self._have > n else [], self._have - n
        return self._heard(RxBlock(self._received, n, whole[:n], "", self._last_ns))

    def _missing(self) -> RxBlock:
        n, self._gap = self._gap, 0
        if self._notice != NOT_THERE:
            self.counters["samples_lost"] += n
        return self._heard(RxBlock(self._received, n, None, self._notice, self._last_ns))

    def _heard(self, block: RxBlock) -> RxBlock:
        with self._lock:
            self._received += block.n
        return block

    def _wait(self) -> None:
        """Let the clock set the pace while the peer does not."""
        silent_ns = time.monotonic_ns() - self._last_ns
        if not self._paced or silent_ns < QUIET_S * 1e9:
            return
        self.counters["outages"] += self._notice != NOT_THERE
        self._notice = NOT_THERE
        self._last_ns += silent_ns
        self._gap += round(1e-9 * silent_ns * self._rate_hz)

    def _emit(self, sink: Sink) -> None:
        """Send as many samples as were received, plus the lead."""
        while True:
            if self._unsent and not sink.send(self._unsent):
                return
            self._unsent = b""
            ahead = self._received + self._lead - self._sent
            if ahead > 2 * self._lead:
                # Nobody took these samples: their time has passed, so they are dropped.
                self.counters["skips"] += 1
                self._next_samples(ahead - self._lead)
                continue
            n = sink.wanted(min(ahead, self._n)) if ahead > 0 else 0
            if not n:
                return
            self._unsent, clipped = self._type.encode(self._next_samples(n))
            self.counters["clipped"] += clipped

    def _next_samples(self, n: int) -> Samples:
        with self._lock:
            samples = self._line.take(self._sent, n)
            self._sent += n
        return np.zeros(n, np.complex64) if samples is None else samples
