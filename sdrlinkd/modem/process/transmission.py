"""Sends bursts: modulates them off the event loop, and reports them once they have left."""

import asyncio
import time
from collections.abc import Awaitable, Callable
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np

import phy
from backends import GAP, BackendError, Radio, Samples, TxBurst, TxOutcome, TxReport
from sdrlinkd.config import ModemParams
from sdrlinkd.link import Outcome
from sdrlinkd.modem.modem import BurstOrder, BurstReport
from sdrlinkd.modem.tempo import Tempo
from sdrlinkd.wire import leaves_later

SHORT = 20_000
"""Longest burst in samples that is modulated on the event loop: using a thread takes longer."""
LATE_S = 5e-4
"""Time in s by which a burst may miss its start: a radio that makes blocks often keeps it all the
same. What is later than this was interrupted."""
STALE_S = 0.1
"""A burst that misses its start by more is returned as late: this process stood still, and messages
in the burst may have outlived their lifespans. The link decides whether it is sent again.
"""
AGAIN = 2
"""How many more times a burst is modulated that became late meanwhile."""
OUTCOMES = {
    TxOutcome.SENT: Outcome.SENT,
    TxOutcome.LATE: Outcome.LATE,
    TxOutcome.UNDERFLOW: Outcome.UNDERFLOW,
    TxOutcome.LOST: Outcome.LOST,
}


class _Modulated(NamedTuple):
    order: BurstOrder
    samples: Samples
    took_s: float


class Transmission:
    """The transmit side of the modem: modulates bursts and hands them to the radio.

    `now` gives the index of the sample that is on the air now; None: bursts are never too late, as
    in lock-step. A burst that would miss its start by more than LATE_S gets a later one before it
    is modulated, and the times that it tells are adjusted.
    """

    def __init__(
        self, params: ModemParams, radio: Radio, now: Callable[[], int] | None = None
    ) -> None:
        self._radio = radio
        self._now = now
        self._rate_hz = params.rate_hz
        self._tempo = Tempo()
        self._free_from = 0
        self._grid = phy.GRIDS[params.grid]
        self._transmitter = phy.Transmitter(params.network, self._grid, params.preamble_boost_db)
        self._amplitude = 10 ** (-params.backoff_db / 20)
        self._thread = ThreadPoolExecutor(1, "phy-tx")
        self._tasks: asyncio.TaskGroup | None = None
        self._left: Callable[[BurstReport], None]
        self._at_once = False
        self._in_thread = 0
        self._early: list[BurstOrder] = []
        self._late = self._late_by_radio = 0
        self._pending: set[int] = set()
        self.counters = {"bursts_slipped": 0, "bursts_postponed": 0, "samples_sent": 0}

    def start(self, tasks: asyncio.TaskGroup, left: Callable[[BurstReport], None]) -> None:
        """Start to accept bursts; `left` is called with the report of each."""
        self._tasks, self._left = tasks, left
        self._at_once = self._radio.capabilities.lockstep
        early, self._early = self._early, []
        for order in early:
            self.send(order)

    def send(self, order: BurstOrder) -> None:
        """Send a burst; one that comes before `start` waits for it."""
        if self._tasks is None:
            self._early.append(order)
            return
        self._pending.add(order.number)
        if self._now is not None and self._is_stale(order, self._now()):
            told = BurstReport(order.number, Outcome.LATE, self._now())
            asyncio.get_running_loop().call_soon(self._end, told)
            return
        # A short burst must not overtake one that the thread still modulates.
        n = self._samples(order)
        if self._at_once or (n <= SHORT and not self._in_thread):
            made = self._made(order, n)
            answer = self._hand_over(made)
            self._tasks.create_task(self._settle(made, answer))
        else:
            self._in_thread += 1
            self._tasks.create_task(self._transmit(order, n))

    def close(self) -> None:
        """Report no more bursts, and stop the modulating thread after its current one."""
        self._pending.clear()
        self._thread.shutdown(wait=True, cancel_futures=True)

    async def _transmit(self, order: BurstOrder, n_samples: int) -> None:
        loop = asyncio.get_running_loop()
        try:
            if order.number not in self._pending:
                # The radio is closed.
                return
            made = await loop.run_in_executor(self._thread, self._made, order, n_samples)
        finally:
            self._in_thread -= 1
        await self._settle(made, self._hand_over(made))

    def _made(self, order: BurstOrder, n_samples: int) -> _Modulated:
        """Modulate a burst so that it can keep its start, or with a later start that it can keep.

        If the modulation was interrupted for so long that the burst is late all the same, it is
        modulated again.
        """
        made = self._modulate(self._in_time(order, n_samples))
        for _ in range(AGAIN):
            kept = self._in_time(made.order, 0)
            if kept is made.order:
                break
            made = self._modulate(kept)
        self._free_from = max(self._free_from, made.order.start + n_samples + GAP)
        return made

    def _is_stale(self, order: BurstOrder, now: int) -> bool:
        """Whether the start of a burst has passed long ago, although nothing else has its place."""
        return max(order.start, self._free_from) < now - STALE_S * self._rate_hz

    def _in_time(self, order: BurstOrder, n_samples: int) -> BurstOrder:
        """The order, with a later start if its own has passed once `n_samples` are modulated.

        A start that is missed by LATE_S is kept. A later start after the deadline does not help.
        """
        if self._now is None:
            return order
        takes = round(self._tempo.seconds(n_samples) * self._rate_hz)
        start = max(self._now() + takes, self._free_from)
        by = start - order.start
        if by <= LATE_S * self._rate_hz or (order.latest is not None and start > order.latest):
            return order
        self.counters["bursts_postponed"] += 1
        pdus = order.pdus
        if order.n_timed:
            by_us, n = round(1e6 * by / self._rate_hz), order.n_timed
            pdus = [*(leaves_later(pdu, by_us) for pdu in pdus[:n]), *pdus[n:]]
        return order._replace(start=start, pdus=pdus)

    def _hand_over(self, made: _Modulated) -> Awaitable[TxReport] | None:
        """Hand a burst to the radio; None if it must not overtake a late burst.

        That is the case if a burst has become late that was not known to be late when this one was
        composed. The radio's counter may show that before the late burst is settled.
        """
        order, samples = made.order, made.samples
        if order.latest is not None:
            is_known = order.late_known == self._late
            if not is_known or self._late_by_radio != self._radio.counters["late"]:
                return None
        self.counters["samples_sent"] += len(samples)
        return self._radio.send(TxBurst(order.start, samples, order.latest))

    async def _settle(self, made: _Modulated, answer: Awaitable[TxReport] | None) -> None:
        order = made.order
        told = BurstReport(
            order.number,
            Outcome.LATE,
            order.start,
            n_samples=len(made.samples),
            modulated_s=made.took_s,
        )
        if answer is None:
            self._end(told)
            return
        try:
            report = await answer
        except BackendError as error:
            told = told._replace(outcome=Outcome.LOST, problem=str(error))
        else:
            self.counters["bursts_slipped"] += report.start > order.start
            self._late_by_radio += report.outcome is TxOutcome.LATE
            outcome = OUTCOMES[report.outcome]
            left_at = report.start if outcome is Outcome.SENT else None
            told = told._replace(outcome=outcome, end=report.end, start=left_at)
        self._end(told)

    def _end(self, told: BurstReport) -> None:
        self._late += told.outcome is Outcome.LATE
        if told.number in self._pending:
            self._pending.remove(told.number)
            self._left(told)

    def _samples(self, order: BurstOrder) -> int:
        """Length of a burst in samples; without PDUs, it is a pulse."""
        if not order.pdus:
            return phy.N_PULSE
        return phy.layout(self._grid, order.mcs, len(order.pdus), len(order.pdus[0])).n_samples

    def _modulate(self, order: BurstOrder) -> _Modulated:
        """The samples of a burst, scaled to leave room for its peaks."""
        if not order.pdus:
            return _Modulated(order, phy.pulse() * np.float32(self._amplitude), 0.0)
        began = time.perf_counter()
        samples: Samples = self._transmitter.modulate(order.pdus, order.mcs) * self._amplitude
        took_s = time.perf_counter() - began
        self._tempo.note(len(samples), took_s)
        return _Modulated(order, samples, took_s)
