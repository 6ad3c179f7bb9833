"""Captures a radio's samples into a recording with annotated bursts; nothing is ever sent."""

import asyncio
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple, Self

import phy
from backends import BackendError, Radio, RecordingWriter, Tuning
from sdrlinkd import __version__
from sdrlinkd.errors import UserError
from sdrlinkd.iq.finder import BurstFinder
from sdrlinkd.iq.keeper import Keeper

LOOK_S = 0.1
SWITCH_INTERVAL_S = 1e-4
"""Interpreter's switch interval in s; with the default, the burst search delays the radio by 5 ms.
"""
WAITING_S = 1.0
"""Longest stretch of samples in s that waits for a slow disk."""


class CaptureWish(NamedTuple):
    """Settings of a capture.

    It records up to `seconds` (None: until stopped) and annotates bursts of `network` (None: all).
    """

    path: Path
    type_name: str
    seconds: float | None
    network: int | None
    grid: phy.Numerology


class CaptureState(NamedTuple):
    """Progress of a capture, for the screen."""

    recorded_s: float
    searched_s: float
    level_dbfs: float
    n_bursts: int
    n_gaps: int
    is_recorded: bool
    """Whether recording is over and only the search for bursts continues."""
    radio: str


class CaptureReport(NamedTuple):
    """What a recording holds; `n_full` values, two per sample, are at full scale, i.e. clipped."""

    n_samples: int
    seconds: float
    searched_s: float
    """Length in s, from the start, of the part that was searched for bursts."""
    n_bursts: int
    pdus_good: int
    pdus_bad: int
    n_gaps: int
    samples_lost: int
    mean_dbfs: float
    peak_dbfs: float
    n_full: int
    problem: str
    """Why the recording ended early; empty if it did not."""


class Capture:
    """One capture from one radio, which is open within `async with`.

    Raises UserError if the radio or the files cannot be opened.
    """

    def __init__(self, radio: Radio, tuning: Tuning, wish: CaptureWish) -> None:
        self._radio, self._tuning, self._wish = radio, tuning, wish
        self._ended = asyncio.Event()
        self._keeper: Keeper | None = None
        self._problem = ""

    async def __aenter__(self) -> Self:
        # Otherwise the first burst would wait for the code to be compiled.
        await asyncio.to_thread(phy.warm_up)
        try:
            await self._radio.open(self._tuning)
        except BackendError as error:
            await self._radio.close()
            raise UserError(str(error)) from None
        return self

    async def __aexit__(self, *_: object) -> None:
        await self._radio.close()

    def stop(self) -> None:
        """Stop receiving; a second call also stops the search for bursts."""
        if self._ended.is_set() and self._keeper is not None:
            self._keeper.give_up()
        self._ended.set()

    async def run(self, watch: Callable[[CaptureState], None]) -> CaptureReport:
        """Record until the wished length, the end of the radio's stream, or a call of `stop`."""
        try:
            finder, keeper = self._begin()
        except BackendError as error:
            raise UserError(str(error)) from None
        interval_s = sys.getswitchinterval()
        sys.setswitchinterval(SWITCH_INTERVAL_S)
        async with asyncio.TaskGroup() as tasks:
            watching = tasks.create_task(self._watch(watch, finder, keeper))
            receiving = tasks.create_task(self._receive(keeper))
            try:
                await self._ended.wait()
            finally:
                self._ended.set()
                receiving.cancel()
                await self._radio.close()
                await asyncio.to_thread(keeper.finish)
                watching.cancel()
                sys.setswitchinterval(interval_s)
        if isinstance(keeper.failure, BackendError):
            raise UserError(str(keeper.failure))
        if keeper.failure is not None:
            raise keeper.failure
        return self._report(finder, keeper)

    def _begin(self) -> tuple[BurstFinder, Keeper]:
        wish, radio = self._wish, self._radio
        rate_hz, frequency_hz = self._tuning.rate_hz, self._tuning.frequency_hz
        can = radio.capabilities
        if not can.receives:
            raise BackendError(
                f"this radio does not receive ({radio.detail}); allowed: one that does"
            )
        writer = RecordingWriter(
            wish.path,
            wish.type_name,
            rate_hz,
            frequency_hz,
            hardware=radio.detail,
            description=f"Bursts of sdrlinkd's OFDM modem, {wish.grid.n_fft} subcarriers and a "
            f"cyclic prefix of {wish.grid.n_cp} samples, are annotated",
            recorder=f"sdrlinkd {__version__}",
        )
        finder = BurstFinder(writer.read, rate_hz, frequency_hz, wish.network, wish.grid)
        loop = asyncio.get_running_loop()

        def ended() -> None:
            loop.call_soon_threadsafe(self._ended.set)

        keeper = self._keeper = Keeper(
            writer,
            finder,
            rate_hz,
            None if wish.seconds is None else max(1, round(wish.seconds * rate_hz)),
            round(WAITING_S / can.block_s),
            ended,
        )
        return finder, keeper

    async def _receive(self, keeper: Keeper) -> None:
        try:
            async for block in self._radio.blocks(keeper.put):
                # Blocks that were not handled on the radio's thread, as in lock-step.
                await asyncio.to_thread(keeper.put, block)
        except BackendError as error:
            self._problem = str(error)
        self._ended.set()

    async def _watch(
        self, watch: Callable[[CaptureState], None], finder: BurstFinder, keeper: Keeper
    ) -> None:
        rate_hz = self._tuning.rate_hz
        while True:
            watch(
                CaptureState(
                    recorded_s=keeper.end / rate_hz,
                    searched_s=finder.next_index / rate_hz,
                    level_dbfs=keeper.level.recent_dbfs,
                    n_bursts=finder.n_bursts,
                    n_gaps=keeper.n_gaps,
                    is_recorded=self._ended.is_set(),
                    radio=self._radio.detail,
                )
            )
            await asyncio.sleep(LOOK_S)

    def _report(self, finder: BurstFinder, keeper: Keeper) -> CaptureReport:
        rate_hz, level = self._tuning.rate_hz, keeper.level
        return CaptureReport(
            n_samples=keeper.end,
            seconds=keeper.end / rate_hz,
            searched_s=finder.next_index / rate_hz,
            n_bursts=finder.n_bursts,
            pdus_good=finder.n_good,
            pdus_bad=finder.n_bad,
            n_gaps=keeper.n_gaps,
            samples_lost=keeper.n_lost,
            mean_dbfs=level.mean_dbfs,
            peak_dbfs=level.peak_dbfs,
            n_full=level.n_full,
            problem=keeper.problem or self._problem,
        )
