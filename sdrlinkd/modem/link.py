"""The modem link: decides bursts at the last moment, and hands them to a modem."""

import asyncio
import math
import time
from collections.abc import Awaitable, Callable, Sequence
from functools import partial

from backends import AbsentError, BackendError, Capabilities, RefusalError
from sdrlinkd.config import ModemParams
from sdrlinkd.errors import ConfigError, LinkAbsentError, LinkRefusedError, UserError
from sdrlinkd.link import Opportunity, Outcome, PduLinkTraits
from sdrlinkd.modem.airtimes import Airtimes
from sdrlinkd.modem.clock import StreamClock
from sdrlinkd.modem.modem import BurstReport, Modem, NoModem
from sdrlinkd.modem.on_air import OnAir
from sdrlinkd.modem.plan import AirPlan, TxWindowPlan
from sdrlinkd.modem.report import modem_report
from sdrlinkd.modem.tempo import Tempo
from sdrlinkd.modem.traits import pdu_link_traits
from sdrlinkd.modem.turns import INFINITE, Turns
from sdrlinkd.pdulink import Carry, Heard, Observe, PduListener
from sdrlinkd.reports import PduLinkReport


class ModemLink:
    """A PDU link over the modem that `choose` makes; it handles PDUs, and never samples.

    In lock-step, each block is completely processed before the next one. `lead_grows`: whether, for
    such a radio, bursts at fixed times are handed over earlier once the machine proves slow.
    `began_s`: start of the link's clock on the monotonic clock; None: the link's clock starts with
    the samples.
    """

    def __init__(
        self,
        params: ModemParams,
        pdu_size: int,
        choose: Callable[[], Awaitable[Modem]],
        kind: str,
        lead_grows: Callable[[PduLinkTraits], bool] = lambda _: False,
        began_s: float | None = None,
    ) -> None:
        self._params = params
        self._began_s = began_s
        self._choose = choose
        self._modem: Modem = NoModem()
        self._kind = kind
        self._airtimes = Airtimes(params, pdu_size)
        self._may_lead_grow = lead_grows
        self._lead_grows = False
        self._clock = StreamClock(params.rate_hz, paced=True, began_s=began_s)
        self._plan = AirPlan(0)
        self._tempo = Tempo()
        self._on_air = OnAir()
        self._can: Capabilities | None = None
        self._listener: PduListener | None = None
        self._turns = Turns(self._turn, self._is_paced)
        self._settled, self._is_refused = asyncio.Event(), asyncio.Event()
        self._state = "down"
        self._problem = ""
        self._observe: Observe | None = None

    def now(self) -> float:
        """Time in s on the received stream's clock."""
        return self._clock.now(self._modem.seen, time.monotonic())

    async def open(self, listener: PduListener) -> Carry:
        """Open the modem. Raises LinkAbsentError, LinkRefusedError or UserError."""
        params = self._params
        try:
            self._modem = await self._choose()
            can = self._can = await self._modem.open()
            self._modem.observe(self._observe)
        except AbsentError as error:
            raise LinkAbsentError(str(error)) from None
        except RefusalError as error:
            raise LinkRefusedError(str(error)) from None
        except BackendError as error:
            raise UserError(str(error)) from None
        traits = pdu_link_traits(self._kind, can, params, self._airtimes)
        self._lead_grows = self._may_lead_grow(traits)
        if not can.paced:
            # Time is that of the samples; a clock that already runs continues.
            began_s = None if can.lockstep else self._began_s
            self._clock = StreamClock(params.rate_hz, can.paced, can.lockstep, began_s)
        lead, ahead = traits.lead_s * params.rate_hz, traits.ahead_s * params.rate_hz
        self._plan = AirPlan(math.ceil(lead), round(ahead))
        if can.tx_windows is not None:
            self._plan = TxWindowPlan(math.ceil(lead), round(ahead), can.tx_windows, params.rate_hz)
        try:
            listener.attach(traits)
        except ConfigError as error:
            raise LinkRefusedError(str(error)) from None
        self._listener = listener
        self._state = "up"
        return partial(self._carry, can)

    async def _carry(self, can: Capabilities) -> None:
        """Receive and send until cancelled. Raises LinkAbsentError, LinkRefusedError."""
        running = [asyncio.ensure_future(self._modem.run(self))]
        if not can.lockstep:
            running.append(asyncio.ensure_future(self._turns.run()))
        refusal = asyncio.ensure_future(self._is_refused.wait())
        # A paced modem wakes us only while something waits.
        self._modem.wakes = not can.paced
        try:
            await asyncio.wait((*running, refusal), return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in (*running, refusal):
                task.cancel()
            await asyncio.wait((*running, refusal))
        if self._is_refused.is_set():
            raise LinkRefusedError(self._problem)
        for task in running:
            if not task.cancelled() and (error := task.exception()) is not None:
                self._state, self._problem = "down", str(error)
                raise LinkAbsentError(str(error)) if isinstance(error, AbsentError) else error

    def wake(self) -> None:
        """Check again whether there is something to send."""
        self._turns.wake()

    def observe(self, tell: Observe | None) -> None:
        """Call `tell` with what is on the air, some times a second; None: no longer."""
        self._observe = tell
        self._modem.observe(tell)

    async def idle(self) -> None:
        """Wait until every burst handed over is settled."""
        while self._on_air:
            self._settled.clear()
            await self._settled.wait()

    async def close(self) -> None:
        """Close the modem; bursts that have not left are lost."""
        await self._modem.close()
        listener, self._listener = self._listener, None
        if listener is not None:
            for burst in self._on_air.take_all():
                listener.settled(burst, Outcome.LOST, self.now())
        if self._state == "up":
            self._state = "ended"

    def report(self) -> PduLinkReport:
        """The report: state, counters of radio and receiver, and whether the PHY keeps up."""
        seen = self._modem.seen
        return modem_report(
            self._kind,
            "down" if self._is_gone else self._state,
            self._problem,
            self._params,
            self._modem.status,
            self._can,
            0 if seen is None else seen.end,
        )

    # The modem's user.

    def delivered(self, heard: Sequence[Heard], _end: int) -> None:
        """Pass on PDUs; in lock-step, process everything that follows from a block."""
        if self._modem.wakes:
            self._turns.wake()
        listener = self._listener
        if listener is None:
            return
        if heard:
            listener.heard(heard)
        if self._can is not None and self._can.lockstep:
            listener.advance(self.now())
            while self._turn() == 0:
                pass

    def left(self, report: BurstReport) -> None:
        """Handle the outcome of a burst: adapt the lead, and inform the listener."""
        if report.modulated_s:
            self._tempo.note(report.n_samples, report.modulated_s)
        burst = self._on_air.take(report)
        if burst is None:
            return
        if self._lead_grows and report.outcome is Outcome.LATE:
            self._plan.was_late()
        elif self._lead_grows:
            self._plan.was_in_time()
        if self._listener is not None:
            if report.problem:
                self._problem = report.problem
            if report.start is not None:
                burst = burst._replace(start=report.start / self._params.rate_hz)
            self._listener.settled(burst, report.outcome, report.end / self._params.rate_hz)
        self._settled.set()
        self._turns.wake()

    def ended(self, problem: str, is_refusal: bool) -> None:
        """Note that the stream has ended."""
        self._state, self._problem = "down" if problem else "ended", problem
        if is_refusal:
            self._is_refused.set()
        self._turns.wake()

    def _is_paced(self) -> bool:
        return self._can is not None and self._can.paced

    @property
    def _is_gone(self) -> bool:
        if self._state != "up" or self._can is None or not self._can.paced:
            return False
        modem = self._modem
        return bool(modem.trouble) or self._clock.is_gone(modem.seen, time.monotonic())

    def _turn(self) -> float:
        """Send the next burst if it may leave; returns 0, or the time in s until one may leave."""
        listener, rate = self._listener, self._params.rate_hz
        modem, can = self._modem, self._can
        if listener is None or can is None or self._state != "up" or not can.transmits:
            return INFINITE
        if self._is_gone or (self._began_s is not None and modem.seen is None):
            # Wait for a block: the first one shows where the stream starts on our clock.
            modem.wakes = True
            return INFINITE
        now = self.now()
        wait_s = listener.next_wakeup(now) - now
        if wait_s > 0:
            return wait_s
        index = round(now * rate)
        wait = self._plan.wait(index)
        if wait:
            return wait / rate
        airtimes = self._airtimes
        opportunity = Opportunity(
            self._plan.start(index) / rate,
            airtimes.airtime_s,
            airtimes.most_pdus,
            modem.sensed,
        )
        if can.paced:
            tempo = self._tempo
            opportunity = opportunity._replace(
                made_by=lambda start: tempo.samples_in(start - now) / rate
            )
        burst = listener.next_burst(opportunity)
        if can.paced:
            modem.wakes = burst is None
        if burst is None:
            # Messages that may not leave yet are checked again with the next block. But a partly
            # filled PDU may have started to wait for more messages.
            wait_s = listener.next_wakeup(now) - now
            return wait_s if wait_s > 0 else INFINITE
        start = round(burst.start * rate)
        self._plan.commit(start, self._airtimes.samples(burst.mcs, len(burst.pdus)))
        modem.send(self._on_air.add(burst, start, rate))
        return 0.0
