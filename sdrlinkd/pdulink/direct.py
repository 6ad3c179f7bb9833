"""The direct link, which returns PDUs to this node, as in the paper's loopback without a PHY."""

import asyncio
import time
from collections.abc import Callable, Sequence
from functools import partial
from random import Random

from sdrlinkd.config import DirectParams
from sdrlinkd.link import Burst, Opportunity, Outcome, PduLinkTraits
from sdrlinkd.pdulink.base import Carry, Heard, Observe, PduListener
from sdrlinkd.pdulink.bell import Bell
from sdrlinkd.pdulink.impairment import Impairment
from sdrlinkd.reports import PduLinkReport


class DirectLink:
    """A PDU link that loops bursts back to this node, paced and impaired as configured."""

    def __init__(self, params: DirectParams, pdu_size: int, rng: Random) -> None:
        self._params = params
        self._airtime_per_pdu_s = (
            8 * pdu_size / max(params.rate_bit_s, 1.0) if params.rate_bit_s else 0.0
        )
        self._impairment = Impairment(params, rng)
        self._listener: PduListener | None = None
        self._free_at = 0.0
        self._on_air: list[Burst] = []
        self._timers: set[asyncio.TimerHandle] = set()
        self._pdus = 0
        self._bell = Bell()
        self._all_settled = asyncio.Event()
        self._all_settled.set()

    def now(self) -> float:
        """Time in s of the monotonic clock, as there are no samples to count."""
        return time.monotonic()

    async def open(self, listener: PduListener) -> Carry:
        """Attach the listener; there is nothing to open."""
        self._listener = listener
        listener.attach(PduLinkTraits())
        return partial(self._carry, listener)

    async def _carry(self, listener: PduListener) -> None:
        """Request a burst when the last one has left, but always after a turn of the event loop."""
        while True:
            await asyncio.sleep(max(0.0, self._free_at - self.now()))
            self._bell.hush()
            start = self.now()
            burst = listener.next_burst(Opportunity(start, self._airtime_s, self._most_pdus))
            if burst is not None:
                self._send(burst, start)
                continue
            await self._bell.wait(max(0.0, listener.next_wakeup(start) - start))

    def wake(self) -> None:
        """Check again whether there is something to send."""
        self._bell.ring()

    def _airtime_s(self, _: int, n_pdus: int) -> float:
        return self._airtime_per_pdu_s * n_pdus

    def _most_pdus(self, _: int, airtime_s: float) -> int:
        most = self._params.max_pdus_per_burst
        if not self._airtime_per_pdu_s:
            return most
        return int(min(most, airtime_s / self._airtime_per_pdu_s))

    def _send(self, burst: Burst, start: float) -> None:
        """Send a burst; its PDUs arrive when the last of them has left."""
        airtime_s = self._airtime_per_pdu_s * len(burst.pdus)
        self._free_at = start + airtime_s
        self._pdus += len(burst.pdus)
        self._on_air.append(burst)
        self._all_settled.clear()
        if airtime_s:
            self._later(airtime_s, partial(self._left, burst, start))
        else:
            self._left(burst, start)

    def observe(self, tell: Observe | None) -> None:
        """Nothing: there is no modem."""

    async def idle(self) -> None:
        """Wait until every burst handed over is settled."""
        await self._all_settled.wait()

    async def close(self) -> None:
        """Close the link; PDUs in transit are lost."""
        listener, self._listener = self._listener, None
        for timer in self._timers:
            timer.cancel()
        self._timers.clear()
        for burst in self._on_air:
            if listener is not None:
                listener.settled(burst, Outcome.LOST, self.now())
        self._on_air.clear()
        self._all_settled.set()

    def report(self) -> PduLinkReport:
        """The state of the link, its faults and its counters."""
        rate = f"{self._params.rate_bit_s / 1e6:g} Mbit/s" if self._params.rate_bit_s else "no pace"
        faults = [
            f"{name} {value:g}"
            for name, value in (
                ("loss", self._params.loss),
                ("delay_s", self._params.delay_s),
                ("jitter_s", self._params.jitter_s),
                ("duplicate", self._params.duplicate),
                ("corrupt", self._params.corrupt),
            )
            if value
        ]
        return PduLinkReport(
            kind="direct",
            state="up" if self._listener is not None else "down",
            detail=", ".join([rate, *faults]),
            counters={"pdus": self._pdus, **self._impairment.counters},
        )

    def _left(self, burst: Burst, start: float) -> None:
        if self._listener is None:
            return
        self._on_air.remove(burst)
        if not self._on_air:
            self._all_settled.set()
        self._listener.settled(burst, Outcome.SENT, self.now())
        now: list[Heard] = []
        for data in burst.pdus:
            for delay_s, arrived in self._impairment.arrivals(data):
                if delay_s:
                    heard = [Heard(arrived, start + delay_s, None, self.now() + delay_s)]
                    self._later(delay_s, partial(self._deliver, heard))
                else:
                    now.append(Heard(arrived, start, None, self.now()))
        if now:
            self._deliver(now)

    def _deliver(self, heard: Sequence[Heard]) -> None:
        if self._listener is not None:
            self._listener.heard(heard)

    def _later(self, delay_s: float, action: Callable[[], None]) -> None:
        def run() -> None:
            self._timers.discard(timer)
            action()

        timer = asyncio.get_running_loop().call_later(delay_s, run)
        self._timers.add(timer)
