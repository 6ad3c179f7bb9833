"""Sends bursts: modulates them off the event loop, and settles them once they have left."""

import asyncio
import math
import time
from collections.abc import Awaitable, Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import phy
from backends import BackendError, Radio, Samples, TxBurst, TxOutcome, TxReport
from sdrlinkd.config import ModemParams
from sdrlinkd.link import Burst, Outcome
from sdrlinkd.modem.tempo import Tempo
from sdrlinkd.pdulink import PduListener

INFINITE = float("inf")
SHORT = 20_000
"""Longest burst in samples that is modulated on the event loop: using a thread takes longer."""
OUTCOMES = {
    TxOutcome.SENT: Outcome.SENT,
    TxOutcome.LATE: Outcome.LATE,
    TxOutcome.UNDERFLOW: Outcome.UNDERFLOW,
    TxOutcome.LOST: Outcome.LOST,
}


class BurstReport(NamedTuple):
    """The outcome of a burst, the index of its end and, in words, what went wrong."""

    outcome: Outcome
    end: int
    problem: str = ""
    start: int | None = None
    """Index of the burst's first sample, if it left."""


class Transmission:
    """The transmit side of the modem: modulates bursts and hands them to the radio."""

    def __init__(self, params: ModemParams, radio: Radio) -> None:
        self._radio = radio
        self._rate_hz = params.rate_hz
        grid = phy.GRIDS[params.grid]
        self._transmitter = phy.Transmitter(params.network, grid, params.preamble_boost_db)
        self._amplitude = 10 ** (-params.backoff_db / 20)
        self._thread = ThreadPoolExecutor(1, "phy-tx")
        self._tasks: asyncio.TaskGroup | None = None
        self._left: Callable[[Burst, BurstReport], None]
        self._at_once = False
        self._in_thread = 0
        self.tempo = Tempo()
        self._late = self._late_by_radio = 0
        self.on_air: list[Burst] = []
        self.counters = {"bursts_slipped": 0, "samples_sent": 0}

    def start(self, tasks: asyncio.TaskGroup, left: Callable[[Burst, BurstReport], None]) -> None:
        """Start to accept bursts; `left` is called with the report of each."""
        self._tasks, self._left = tasks, left
        self._at_once = self._radio.capabilities.lockstep

    def send(self, burst: Burst, start: int) -> None:
        """Send a burst whose first sample has index `start`."""
        if self._tasks is None:
            raise RuntimeError("send before start")
        self.on_air.append(burst)
        known = (self._late, self._late_by_radio)
        # A short burst must not overtake one that the thread still modulates.
        is_short = burst.airtime_s * self._rate_hz <= SHORT and not self._in_thread
        if self._at_once or is_short:
            answer = self._hand_over(burst, start, self._modulate(burst.pdus, burst.mcs), known)
            self._tasks.create_task(self._settle(burst, start, answer))
        else:
            self._in_thread += 1
            self._tasks.create_task(self._transmit(burst, start, known))

    def lose(self, listener: PduListener, now: float) -> None:
        """Settle all pending bursts as lost, as the radio is closed."""
        for burst in self.on_air:
            listener.settled(burst, Outcome.LOST, now)
        self.on_air.clear()

    def close(self) -> None:
        """Stop the modulating thread after its current burst."""
        self._thread.shutdown(wait=True, cancel_futures=True)

    async def _transmit(self, burst: Burst, start: int, known: tuple[int, int]) -> None:
        loop = asyncio.get_running_loop()
        try:
            if burst not in self.on_air:
                # The burst is already settled as lost, as the radio is closed.
                return
            samples = await loop.run_in_executor(
                self._thread, self._modulate, burst.pdus, burst.mcs
            )
        finally:
            self._in_thread -= 1
        await self._settle(burst, start, self._hand_over(burst, start, samples, known))

    def _hand_over(
        self, burst: Burst, start: int, samples: Samples, known: tuple[int, int]
    ) -> Awaitable[TxReport] | None:
        """Hand a burst to the radio; None if it must not overtake a late burst.

        That is the case if a burst has become late that was not `known` to be late when this one
        was composed. The radio's counter may show that before the late burst is settled.
        """
        latest = None
        if burst.latest != INFINITE:
            if known != (self._late, self._radio.counters["late"]):
                return None
            # `start` is rounded to a sample; `latest` may round to the same one.
            latest = start + math.floor((burst.latest - burst.start) * self._rate_hz)
        self.counters["samples_sent"] += len(samples)
        return self._radio.send(TxBurst(start, samples, latest))

    async def _settle(self, burst: Burst, start: int, answer: Awaitable[TxReport] | None) -> None:
        if answer is None:
            self._end(burst, BurstReport(Outcome.LATE, start))
            return
        try:
            report = await answer
        except BackendError as error:
            told = BurstReport(Outcome.LOST, start, str(error))
        else:
            self.counters["bursts_slipped"] += report.start > start
            self._late_by_radio += report.outcome is TxOutcome.LATE
            outcome = OUTCOMES[report.outcome]
            left_at = report.start if outcome is Outcome.SENT else None
            told = BurstReport(outcome, report.end, start=left_at)
        self._end(burst, told)

    def _end(self, burst: Burst, told: BurstReport) -> None:
        self._late += told.outcome is Outcome.LATE
        if burst in self.on_air:
            self.on_air.remove(burst)
            self._left(burst, told)

    def _modulate(self, pdus: Sequence[bytes], mcs: int) -> Samples:
        """The samples of a burst, scaled to leave room for its peaks."""
        began = time.perf_counter()
        samples: Samples = self._transmitter.modulate(pdus, mcs) * self._amplitude
        self.tempo.note(len(samples), time.perf_counter() - began)
        return samples
