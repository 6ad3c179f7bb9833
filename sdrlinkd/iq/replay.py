"""Replays the stretches of a recording on a radio, each at its time."""

import asyncio
import math
import time
from collections import deque
from collections.abc import Awaitable, Callable, Iterator
from typing import NamedTuple, Self

import numpy as np

from backends import (
    GAP,
    BackendError,
    Radio,
    Samples,
    Tuning,
    TxBurst,
    TxOutcome,
    TxReport,
)
from sdrlinkd.errors import UserError
from sdrlinkd.iq.recording import IqRecording
from sdrlinkd.iq.replay_plan import ReplayPlan
from sdrlinkd.iq.stretches import Stretch

AHEAD_S = 0.25
"""Time in s by which bursts are handed to the radio before it needs them."""
AHEAD_BLOCKS = 24
"""Number of blocks by which bursts are handed over early, at least, on an unpaced radio, where some
blocks wait to be processed."""
TICK_S = 0.005
GONE_S = 0.12
"""Longest time in s after its end for which a burst stays in the radio's memory."""
LOADED = 4
LOOK_S = 0.1
MOST_AHEAD = 256
"""Most bursts that the radio holds at a time."""


class ReplayState(NamedTuple):
    """Progress of a replay, for the screen."""

    seconds: float
    n_sent: int
    n_bursts: int


class ReplayReport(NamedTuple):
    """What became of `n_bursts`; bursts in none of the other counts were not handed over."""

    n_bursts: int
    sent: int
    late: int
    underflow: int
    lost: int
    slipped: int
    """Bursts that were sent, but not at their planned time."""
    slip_s: float
    """Largest deviation from a burst's planned time, in s."""
    problem: str


class _Out:
    """The bursts held by a radio whose memory has room for two bursts of `room_s`."""

    def __init__(self, room_s: float, rate_hz: float) -> None:
        self._room = round(2 * room_s * rate_hz)
        self._gone_after = round(GONE_S * rate_hz)
        self._bursts: deque[tuple[int, int]] = deque()
        self._n = 0

    def add(self, burst: TxBurst) -> None:
        """Note that the radio holds this burst."""
        n = len(burst.samples)
        self._bursts.append((burst.start + n, n))
        self._n += n

    def has_room(self, n: int, now: int) -> bool:
        """Whether the radio has room for `n` samples, wherever its memory wraps around."""
        while self._bursts and self._bursts[0][0] + self._gone_after < now:
            self._n -= self._bursts.popleft()[1]
        if not self._bursts:
            return True
        return len(self._bursts) < MOST_AHEAD and self._n + 2 * n <= self._room


class Replay:
    """Sends the planned stretches of a recording `times` times.

    The radio is open within `async with`. Raises UserError.
    """

    def __init__(
        self,
        radio: Radio,
        tuning: Tuning,
        recording: IqRecording,
        plan: ReplayPlan,
        times: int,
    ) -> None:
        self._radio, self._tuning = radio, tuning
        self._recording, self._stretches = recording, plan.stretches
        self._times, self._gain = times, np.float32(plan.gain)
        self._n = times * len(plan.stretches)
        self._period = recording.info.n_samples + GAP
        self._out = _Out(plan.room_s, tuning.rate_hz)
        self._loaded: asyncio.Queue[TxBurst] = asyncio.Queue(LOADED)
        self._stopped = asyncio.Event()
        self._outcomes = dict.fromkeys(TxOutcome, 0)
        self._head: TxBurst | None = None
        self._n_taken = self._on_the_way = self._ahead = 0
        self._paced = True
        self._seen: tuple[int, int] | None = None
        self._origin: int | None = None
        self._slips: list[int] = []
        self._problem = ""

    @property
    def seconds(self) -> float:
        """Length of the whole replay in s."""
        return self._times * self._period / self._tuning.rate_hz

    async def __aenter__(self) -> Self:
        try:
            await self._radio.open(self._tuning)
        except BackendError as error:
            await self._radio.close()
            raise UserError(str(error)) from None
        can = self._radio.capabilities
        # An unpaced radio makes blocks before they are processed.
        spare_s = AHEAD_S if can.paced else max(AHEAD_S, AHEAD_BLOCKS * can.block_s)
        ahead_s = can.lead_s + can.turnaround_s + spare_s
        self._ahead, self._paced = math.ceil(ahead_s * self._tuning.rate_hz), can.paced
        return self

    async def __aexit__(self, *_: object) -> None:
        await self._radio.close()

    def stop(self) -> None:
        """Hand over no more bursts; pending bursts are lost."""
        self._stopped.set()

    async def run(self, watch: Callable[[ReplayState], None]) -> ReplayReport:
        """Send until all bursts are settled or `stop` is called. Raises UserError."""
        if not self._radio.capabilities.transmits:
            raise UserError(
                f"this radio does not send ({self._radio.detail}); allowed: one that does"
            )
        async with asyncio.TaskGroup() as tasks:
            helping = [tasks.create_task(self._load()), tasks.create_task(self._watch(watch))]
            helping.append(tasks.create_task(self._receive(tasks)))
            if self._paced:
                helping.append(tasks.create_task(self._keep_time(tasks)))
            await self._stopped.wait()
            for task in helping:
                task.cancel()
            # Pending bursts are lost.
            await self._radio.close()
        return self._report()

    def _planned(self) -> Iterator[tuple[int, Stretch]]:
        for turn in range(self._times):
            for stretch in self._stretches:
                yield turn * self._period + stretch.start, stretch

    async def _load(self) -> None:
        """Read stretches ahead, off the event loop."""
        for start, stretch in self._planned():
            samples = await asyncio.to_thread(self._read, stretch)
            await self._loaded.put(TxBurst(start, samples))

    def _read(self, stretch: Stretch) -> Samples:
        samples: Samples = self._recording.read(stretch.start, stretch.n) * self._gain
        return np.nan_to_num(samples)

    async def _receive(self, tasks: asyncio.TaskGroup) -> None:
        """Use the received stream as the clock; an unpaced stream waits until all is sent."""
        try:
            async for block in self._radio.blocks():
                self._seen = block.index + block.n, block.host_ns
                if not self._paced:
                    await self._hand_over_due(tasks)
                    await asyncio.sleep(0)
                if self._is_done:
                    break
        except BackendError as error:
            self._problem = str(error)
        self._stopped.set()

    async def _keep_time(self, tasks: asyncio.TaskGroup) -> None:
        """Hand over bursts between blocks, and while a radio sends and cannot receive."""
        while not self._is_done:
            if self._seen is not None:
                await self._hand_over_due(tasks)
            await asyncio.sleep(TICK_S)
        self._stopped.set()

    async def _hand_over_due(self, tasks: asyncio.TaskGroup) -> None:
        now, ahead = self._now, self._ahead
        while (head := await self._first()) is not None:
            if self._origin is None:
                self._origin = now + ahead
            burst = head._replace(start=self._origin + head.start)
            if burst.start > now + ahead or not self._out.has_room(len(burst.samples), now):
                break
            self._head = None
            self._out.add(burst)
            self._on_the_way += 1
            tasks.create_task(self._settle(burst, self._radio.send(burst)))

    async def _first(self) -> TxBurst | None:
        """The next burst to hand over, if it has been read; an unpaced stream waits for that."""
        if self._head is None and self._n_taken < self._n:
            if self._paced and self._loaded.empty():
                return None
            self._head = await self._loaded.get()
            self._n_taken += 1
        return self._head

    async def _settle(self, burst: TxBurst, answer: Awaitable[TxReport]) -> None:
        report = await answer
        self._outcomes[report.outcome] += 1
        if report.outcome is TxOutcome.SENT and report.start != burst.start:
            self._slips.append(abs(report.start - burst.start))
        self._on_the_way -= 1

    @property
    def _is_done(self) -> bool:
        return self._n_taken == self._n and self._head is None and not self._on_the_way

    @property
    def _now(self) -> int:
        """Index of the sample that is on the air now."""
        if self._seen is None:
            return 0
        end, host_ns = self._seen
        since_ns = max(0, time.monotonic_ns() - host_ns) if self._paced else 0
        return end + round(1e-9 * since_ns * self._tuning.rate_hz)

    async def _watch(self, watch: Callable[[ReplayState], None]) -> None:
        while True:
            begun = 0 if self._origin is None else max(0, self._now - self._origin)
            seconds = begun / self._tuning.rate_hz
            watch(ReplayState(seconds, self._outcomes[TxOutcome.SENT], self._n))
            await asyncio.sleep(LOOK_S)

    def _report(self) -> ReplayReport:
        done = self._outcomes
        return ReplayReport(
            n_bursts=self._n,
            sent=done[TxOutcome.SENT],
            late=done[TxOutcome.LATE],
            underflow=done[TxOutcome.UNDERFLOW],
            lost=done[TxOutcome.LOST],
            slipped=len(self._slips),
            slip_s=max(self._slips, default=0) / self._tuning.rate_hz,
            problem=self._problem,
        )
