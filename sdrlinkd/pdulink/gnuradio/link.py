"""A GNU Radio flowgraph as the PHY; it gets PDUs one by one, at the rate that it sustains."""

import asyncio
import time
from functools import partial

from sdrlinkd.config import GnuRadioParams
from sdrlinkd.link import Burst, Opportunity, Outcome, PduLinkTraits
from sdrlinkd.pdulink.base import Carry, Heard, Observe, PduListener
from sdrlinkd.pdulink.bell import Bell
from sdrlinkd.pdulink.gnuradio.transport import Transport
from sdrlinkd.reports import PduLinkReport

LOOK_S = 0.02
"""Interval in s for checking whether a flowgraph accepts PDUs again."""
PACE_S = 1e-3
"""Uncertainty of a flowgraph's delay in s."""


class GnuRadioLink:
    """A PDU link that sends bursts of one PDU to a flowgraph; the rest waits in our queue."""

    def __init__(self, params: GnuRadioParams, pdu_size: int, transport: Transport) -> None:
        self._params = params
        self._airtime_s = 8 * pdu_size / params.rate_bit_s
        self._transport = transport
        self._listener: PduListener | None = None
        self._free_at = 0.0
        self._on_air: Burst | None = None
        self._bell = Bell()
        self._settled = asyncio.Event()
        self._settled.set()
        self._is_taken = False
        self._counters = {"pdus_out": 0, "pdus_in": 0}

    def now(self) -> float:
        """Time in s of the monotonic clock, as there are no samples to count."""
        return time.monotonic()

    async def open(self, listener: PduListener) -> Carry:
        """Open the sockets. Raises UserError."""
        self._listener = listener
        await self._transport.open(self._heard)
        airtime_s = self._airtime_s
        traits = PduLinkTraits(
            kind="gnuradio", shares_air=True, longest_burst_s=(airtime_s,),
            pdu_burst_s=(airtime_s,), stamp_s=PACE_S + self._params.delay_s,
        )  # fmt: skip
        listener.attach(traits)
        return partial(self._carry, listener)

    async def _carry(self, listener: PduListener) -> None:
        """Request a PDU when the last one is over and the flowgraph accepts another."""
        while True:
            await asyncio.sleep(max(0.0, self._free_at - self.now()))
            self._settle()
            self._bell.hush()
            self._is_taken = self._transport.is_ready()
            if not self._is_taken:
                await asyncio.sleep(LOOK_S)
                continue
            start = self.now()
            burst = listener.next_burst(Opportunity(start, self._airtime, self._most_pdus))
            if burst is not None:
                self._send(burst, start)
                continue
            await self._bell.wait(max(0.0, listener.next_wakeup(start) - start))

    def wake(self) -> None:
        """Check again whether there is something to send."""
        self._bell.ring()

    def observe(self, tell: Observe | None) -> None:
        """Nothing: there is no modem."""

    async def idle(self) -> None:
        """Wait until every burst handed over is settled."""
        await self._settled.wait()

    async def close(self) -> None:
        """Close the sockets; bursts that have not left are settled as lost."""
        self._settle(Outcome.LOST)
        self._listener = None
        self._transport.close()

    def report(self) -> PduLinkReport:
        """The report: the state of the flowgraph, and counters of PDUs."""
        params, is_open = self._params, self._listener is not None
        state = "up" if is_open and self._is_taken else "down"
        reason = f"nothing accepts PDUs at {params.send} ({params.transport})"
        if not is_open or self._is_taken:
            reason = ""
        return PduLinkReport(
            kind="gnuradio",
            state=state,
            reason=reason,
            detail=f"{params.rate_bit_s / 1e3:g} kbit/s, {params.transport} to {params.send}, from "
            f"{params.receive or 'the same'}",
            counters={**self._counters, **self._transport.counters},
            notices=[f"no flowgraph: {reason}; messages stay queued"] if reason else [],
        )

    def _airtime(self, _: int, n_pdus: int) -> float:
        return self._airtime_s * n_pdus

    def _most_pdus(self, _: int, airtime_s: float) -> int:
        return int(airtime_s >= self._airtime_s)

    def _send(self, burst: Burst, start: float) -> None:
        self._free_at = start + self._airtime_s * len(burst.pdus)
        self._on_air = burst
        self._settled.clear()
        if all(self._transport.send(pdu) for pdu in burst.pdus):
            self._counters["pdus_out"] += len(burst.pdus)
        else:
            self._settle(Outcome.LOST)

    def _settle(self, outcome: Outcome = Outcome.SENT) -> None:
        burst, self._on_air = self._on_air, None
        if burst is not None and self._listener is not None:
            self._listener.settled(burst, outcome, self.now())
        self._settled.set()

    def _heard(self, pdu: bytes) -> None:
        self._counters["pdus_in"] += 1
        if self._listener is not None:
            now = self.now()
            self._listener.heard([Heard(pdu, now - self._params.delay_s, None, now)])
