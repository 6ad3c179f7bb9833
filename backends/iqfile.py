"""A radio that is a recording: it receives from one, transmits into one, or both."""

import contextlib
import threading
from collections.abc import AsyncIterator, Awaitable
from pathlib import Path

from backends.air import Channel, Timeline
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
from backends.outstanding import Outstanding, answered
from backends.pace import Pace
from backends.recording import RecordingReader, describe, refuse_same
from backends.writing import RecordingWriter


class IqFileRadio:
    """Plays `receive` and records what is sent in `transmit`; either may be absent.

    Bursts are recorded as they would arrive over the channel's path; its front end adds noise to
    what is played. Without a recording to play, the received stream is one long gap.
    """

    def __init__(
        self,
        receive: Path | None,
        transmit: Path | None,
        channel: Channel,
        block_s: float,
        paced: bool = True,
        type_name: str = "ci16_le",
        receive_type: str = "",
    ) -> None:
        self._receive, self._transmit = receive, transmit
        self._receive_type, self._type_name = receive_type, type_name
        self._path = channel.make_path()
        self._timeline = Timeline()
        self._front_end = channel.make_front_end()
        self._block_s = block_s
        self._paced = paced
        self._reader: RecordingReader | None = None
        self._writer: RecordingWriter | None = None
        self._outstanding = Outstanding()
        self._feed = BlockFeed(self._next_block, "iqfile", self._outstanding.is_due)
        # The next block's index and the bursts to record must change together.
        self._lock = threading.Lock()
        self._next = 0
        self._is_open = False
        self._late = 0
        self._damage = ""

    @property
    def capabilities(self) -> Capabilities:
        """Both directions at once if both files are named; exact indices."""
        return Capabilities(
            receives=self._receive is not None,
            transmits=self._transmit is not None,
            full_duplex=True,
            timestamps=True,
            paced=self._paced,
            block_s=self._block_s,
            shares_air=False,
        )

    @property
    def counters(self) -> dict[str, int]:
        """Counters of the radio, with the values that clipped in the recording."""
        return {"late": self._late, "clipped": self._writer.clipped if self._writer else 0}

    @property
    def detail(self) -> str:
        """The recordings in one line for people."""
        parts = []
        if self._receive is not None:
            parts.append(f"from {self._receive}")
        if self._transmit is not None:
            parts.append(f"to {self._transmit}")
        if self._damage:
            parts.append(self._damage)
        return ", ".join(parts)

    @property
    def trouble(self) -> str:
        """Always empty: an unusable recording already fails in `open`."""
        return ""

    @property
    def levels(self) -> Levels | None:
        """Level of the blocks so far; None before the first measurement."""
        return self._feed.levels

    async def open(self, tuning: Tuning) -> None:
        """Open the files. Raises BackendError, also when a recording has another sample rate."""
        if self._receive is not None and self._transmit is not None:
            refuse_same(self._receive, self._transmit)
        if self._receive is not None:
            info = describe(self._receive, self._receive_type)
            if info.rate_hz is not None and abs(info.rate_hz / tuning.rate_hz - 1) > 1e-6:
                raise BackendError(
                    f"{info.path}: sampled at {info.rate_hz:g} Hz, but the modem is set to "
                    f"{tuning.rate_hz:g} Hz"
                )
            self._damage = info.damage
            self._reader = RecordingReader(info)
        if self._transmit is not None:
            self._writer = RecordingWriter(
                self._transmit, self._type_name, tuning.rate_hz, tuning.frequency_hz
            )
        self._n = max(1, round(self._block_s * tuning.rate_hz))
        self._pace = Pace(tuning.rate_hz, self._paced)
        self._is_open = True

    def blocks(self, hear: Hear | None = None) -> AsyncIterator[RxBlock]:
        """Yield the recording from beginning to end; without one, gaps forever."""
        self._pace.restart()
        return self._outstanding.blocks(self._feed, hear)

    def send(self, burst: TxBurst) -> Awaitable[TxReport]:
        """Record a burst; blocks() raises BackendError when the disk rejects it."""
        if not self._is_open or self._writer is None:
            return answered(TxReport(TxOutcome.LOST, burst.start, burst.start))
        with self._lock:
            start = self._outstanding.place(burst, self._next + self._path.early)
            if start is None:
                self._late += 1
                return answered(TxReport(TxOutcome.LATE, burst.start, burst.start))
            self._timeline.add(start, burst.samples, self._path)
        return self._outstanding.left(start, len(burst.samples))

    async def close(self) -> None:
        """Close the files; the recording extends up to now."""
        if self._is_open:
            self._is_open = False
            self._pace.end()
            self._feed.stop()
            if self._writer is not None:
                # On a full disk, the recording ends with its last burst.
                with contextlib.suppress(BackendError):
                    self._writer.extend_to(self._next)
        self._outstanding.lose()
        for part in (self._reader, self._writer):
            if part is not None:
                part.close()

    def _next_block(self) -> RxBlock | None:
        """On the feed's thread: make the next block, and record the bursts that have left."""
        first, n = self._next, self._n
        samples: Samples | None = None
        if self._reader is not None:
            samples = self._reader.read(first, n)
            n = len(samples)
            if not n:
                return None
            samples = self._front_end.receive(samples)
        self._pace.wait_for(first + n)
        with self._lock:
            leaving = self._timeline.take(first, n)
            self._next += n
        if self._writer is not None and leaving is not None:
            self._writer.write(first, leaving)
        reason = "" if samples is not None else "nothing to receive"
        return RxBlock(first, n, samples, reason, self._pace.host_ns(first + n))
