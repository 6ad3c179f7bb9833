"""A radio that is a recording: it receives from one, transmits into one, or both."""

import asyncio
from collections.abc import AsyncIterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

from backends.air import Channel
from backends.base import (
    BackendError,
    Capabilities,
    RxBlock,
    Samples,
    Tuning,
    TxBurst,
    TxOutcome,
    TxReport,
)
from backends.outstanding import Outstanding
from backends.pace import Pace
from backends.recording import RecordingReader, RecordingWriter, describe

MAX_BEHIND_S = 0.5


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
        try:
            self._path = channel.make_path()
        except ValueError as error:
            raise BackendError(str(error)) from None
        self._front_end = channel.make_front_end()
        self._block_s = block_s
        self._paced = paced
        self._reader: RecordingReader | None = None
        self._writer: RecordingWriter | None = None
        self._outstanding = Outstanding()
        self._next = 0
        self._closed = asyncio.Event()
        self._closed.set()
        self._thread = ThreadPoolExecutor(1, "iqfile")
        self._counters = {"overflows": 0, "samples_lost": 0, "late": 0}
        self._damage = ""

    @property
    def capabilities(self) -> Capabilities:
        """Both directions at once where both files are named; indices exact."""
        return Capabilities(
            receives=self._receive is not None,
            transmits=self._transmit is not None,
            full_duplex=True,
            timestamps=True,
            paced=self._paced,
        )

    @property
    def counters(self) -> dict[str, int]:
        """Also values that were too large for the recording's sample type."""
        return {**self._counters, "clipped": self._writer.clipped if self._writer else 0}

    @property
    def detail(self) -> str:
        """For people."""
        parts = []
        if self._receive is not None:
            parts.append(f"from {self._receive}")
        if self._transmit is not None:
            parts.append(f"to {self._transmit}")
        if self._damage:
            parts.append(self._damage)
        return ", ".join(parts)

    async def open(self, tuning: Tuning) -> None:
        """Open the files. Raises BackendError, also when a recording is of another rate."""
        if self._receive is not None:
            info = describe(self._receive, self._receive_type)
            if info.rate_hz is not None and abs(info.rate_hz / tuning.rate_hz - 1) > 1e-6:
                raise BackendError(
                    f"{info.path}: is sampled at {info.rate_hz:g} Hz; the modem is set to "
                    f"{tuning.rate_hz:g} Hz"
                )
            self._damage = info.damage
            self._reader = RecordingReader(info)
        if self._transmit is not None:
            self._writer = RecordingWriter(
                self._transmit, self._type_name, tuning.rate_hz, tuning.frequency_hz
            )
        self._n = max(1, round(self._block_s * tuning.rate_hz))
        self._pace = Pace(tuning.rate_hz, self._paced, MAX_BEHIND_S)
        self._closed.clear()

    async def blocks(self) -> AsyncIterator[RxBlock]:
        """The recording from its beginning to its end; without one, gaps without end."""
        loop = asyncio.get_running_loop()
        self._pace.restart()
        while not self._closed.is_set():
            first, n = self._next, self._n
            samples: Samples | None = None
            if self._reader is not None:
                play = partial(self._play, self._reader, first, n)
                samples = await loop.run_in_executor(self._thread, play)
                n = len(samples)
                if not n:
                    self._outstanding.lose()
                    return
            await self._pace.wait_for(first + n)
            if self._closed.is_set():
                return
            self._next += n
            self._outstanding.settle(self._next)
            reason = "" if samples is not None else "nothing to receive"
            yield RxBlock(first, n, samples, reason, self._pace.host_ns(first + n))

    async def send(self, burst: TxBurst) -> TxReport:
        """Record a burst. Raises BackendError when the disk will not take it."""
        if self._closed.is_set() or self._writer is None:
            return TxReport(TxOutcome.LOST, burst.start)
        if burst.start < self._next:
            self._counters["late"] += 1
            return TxReport(TxOutcome.LATE, burst.start)
        loop = asyncio.get_running_loop()
        await loop.run_in_executor(self._thread, self._record, self._writer, burst)
        return await self._outstanding.left(burst.start + len(burst.samples))

    async def close(self) -> None:
        """Close the files; a recording lasts until now."""
        if not self._closed.is_set() and self._writer is not None:
            self._writer.extend_to(self._next)
        self._closed.set()
        self._outstanding.lose()
        self._thread.shutdown(wait=True)
        if self._reader is not None:
            self._reader.close()
        if self._writer is not None:
            self._writer.close()

    def _play(self, reader: RecordingReader, first: int, n: int) -> Samples:
        return self._front_end.receive(reader.read(first, n))

    def _record(self, writer: RecordingWriter, burst: TxBurst) -> None:
        offset, samples = self._path.carry(burst.samples)
        start = burst.start + offset
        cut = max(0, -start)
        writer.write(start + cut, samples[cut:])
