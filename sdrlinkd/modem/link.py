"""The modem link: decides bursts at the last moment; the PHY runs off the event loop."""

import asyncio
import contextlib
import math
import time
from collections.abc import Awaitable, Callable, Sequence
from functools import partial

import phy
from backends import AbsentError, BackendError, LateRadio, Radio, RefusalError, RxBlock, Tuning
from sdrlinkd.config import ModemParams
from sdrlinkd.errors import ConfigError, LinkAbsentError, LinkRefusedError, UserError
from sdrlinkd.link import Burst, Opportunity, Outcome, PduLinkTraits
from sdrlinkd.modem.airtimes import Airtimes
from sdrlinkd.modem.clock import StreamClock
from sdrlinkd.modem.compiled import load_phy
from sdrlinkd.modem.plan import AirPlan, TxWindowPlan
from sdrlinkd.modem.report import modem_report
from sdrlinkd.modem.rx_thread import Demodulation, ReceiverHere, ReceiverThread
from sdrlinkd.modem.sensing_receiver import SensingReceiver
from sdrlinkd.modem.traits import pdu_link_traits
from sdrlinkd.modem.transmission import BurstReport, Transmission
from sdrlinkd.pdulink import Carry, Heard, PduListener
from sdrlinkd.reports import PduLinkReport

TIMER_S = 0.001
"""Resolution of the event loop's timers in s; shorter waits would be busy waiting."""
INFINITE = float("inf")


class ModemLink:
    """A PDU link over a radio. The PHY runs off the event loop, all else on it.

    In lock-step, each block is completely processed before the next one. `listens`: whether the
    receiver senses if the channel is busy. `lead_grows`: whether, for such a radio, bursts at fixed
    times are handed over earlier once the machine proves slow. `began_s`: start of the link's clock
    on the monotonic clock; None: the link's clock starts with the samples. `load` compiles or loads
    the PHY.
    """

    def __init__(
        self,
        params: ModemParams,
        pdu_size: int,
        radio: Radio,
        kind: str,
        listens: bool = False,
        lead_grows: Callable[[PduLinkTraits], bool] = lambda _: False,
        began_s: float | None = None,
        load: Callable[[], Awaitable[None]] = load_phy,
    ) -> None:
        self._params = params
        self._began_s = began_s
        self._radio = radio if began_s is None else LateRadio(radio, self._first_index)
        self._kind = kind
        self._airtimes = Airtimes(params, pdu_size)
        self._receiver = phy.Receiver(
            params.network,
            params.searched_cfo_hz / params.rate_hz,
            phy.GRIDS[params.grid],
            centre_cycles=params.centre_hz / params.rate_hz if params.one_crystal else 0.0,
        )
        sense = phy.EnergyDetector(params.carrier_db) if listens else None
        self._receiving = SensingReceiver(self._receiver, sense, params.rate_hz)
        self._may_lead_grow = lead_grows
        self._lead_grows = False
        self._clock = StreamClock(params.rate_hz, paced=True, began_s=began_s)
        self._load = load
        self._plan = AirPlan(0)
        self._rx: Demodulation | None = None
        self._tx = Transmission(params, self._radio)
        self._listener: PduListener | None = None
        self._moved = asyncio.Event()
        self._state = "down"
        self._problem = ""

    def now(self) -> float:
        """Time in s on the received stream's clock."""
        return self._clock.now(time.monotonic())

    async def open(self, listener: PduListener) -> Carry:
        """Load the PHY, open the radio. Raises LinkAbsentError, LinkRefusedError or UserError."""
        params = self._params
        await self._load()
        tuning = Tuning(params.rate_hz, params.centre_hz)
        try:
            await self._radio.open(tuning)
        except AbsentError as error:
            raise LinkAbsentError(str(error)) from None
        except RefusalError as error:
            raise LinkRefusedError(str(error)) from None
        except BackendError as error:
            raise UserError(str(error)) from None
        can = self._can = self._radio.capabilities
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
        rx: Demodulation
        if can.lockstep:
            rx = ReceiverHere(self._receiving, params.rate_hz, self._step)
        else:
            rx = ReceiverThread(self._receiving, params.rate_hz, self._deliver, not can.paced)
        self._rx = rx
        try:
            listener.attach(traits)
        except ConfigError as error:
            raise LinkRefusedError(str(error)) from None
        self._listener = listener
        self._state = "up"
        return partial(self._carry, rx)

    async def _carry(self, rx: Demodulation) -> None:
        """Receive and send until cancelled. Raises LinkRefusedError."""
        refusal = ""
        async with asyncio.TaskGroup() as tasks:
            self._tx.start(tasks, self._left)
            sending = None if self._can.lockstep else tasks.create_task(self._send_when_due())
            try:
                await self._receive(rx)
            except BackendError as error:
                self._state, self._problem = "down", str(error)
                refusal = str(error) if isinstance(error, RefusalError) else ""
            if not refusal:
                await asyncio.Event().wait()
            elif sending is not None:
                sending.cancel()
        raise LinkRefusedError(refusal)

    def wake(self) -> None:
        """Check again whether there is something to send."""
        self._moved.set()

    async def idle(self) -> None:
        """Wait until every burst handed over is settled."""
        while self._tx.on_air:
            self._moved.clear()
            await self._moved.wait()

    async def close(self) -> None:
        """Close the radio; bursts that have not left are lost."""
        await self._radio.close()
        listener, self._listener = self._listener, None
        if listener is not None:
            self._tx.lose(listener, self.now())
        self._state = "down"
        if self._rx is not None:
            self._rx.stop()
        self._tx.close()

    def report(self) -> PduLinkReport:
        """The report: state, counters of radio and receiver, and whether the PHY keeps up."""
        return modem_report(
            self._kind,
            "down" if self._is_gone else self._state,
            self._problem,
            self._params,
            self._radio,
            {**self._tx.counters, **{name: self._receiver.counters[name] for name in phy.COUNTERS}},
            self._realtime_ratio,
            self._clock.end,
        )

    @property
    def _realtime_ratio(self) -> float:
        return self._rx.load.realtime_ratio if self._rx is not None else 0.0

    @property
    def _is_gone(self) -> bool:
        if self._state != "up" or not self._can.paced:
            return False
        return bool(self._radio.trouble) or self._clock.is_gone(time.monotonic())

    def _first_index(self) -> int:
        """Index of the radio's first sample on the link's clock."""
        return 0 if self._can.lockstep else self._clock.index(time.monotonic())

    async def _receive(self, receiver: Demodulation) -> None:
        """Take blocks from the radio, which has to wait if the receiver falls far behind."""
        paced = self._can.paced

        def hear(block: RxBlock) -> None:
            """Demodulate a block on the radio's thread."""
            self._clock.observe(block.index + block.n, block.host_ns * 1e-9)
            receiver.hear(block)

        self._moved.set()
        async for block in self._radio.blocks(hear if paced else None):
            if paced:
                self._clock.observe(block.index + block.n, block.host_ns * 1e-9)
            await receiver.put(block)
        await receiver.finish()
        self._state = "ended"
        self._moved.set()

    def _deliver(self, events: Sequence[phy.Event], end: int) -> None:
        """Pass on the events that the samples before index `end` completed."""
        if not self._can.paced:
            # Without pace, blocks wait for the receiver, and so does the clock.
            self._clock.observe(end, time.monotonic())
        if self._rx is not None and self._rx.wakes:
            self._moved.set()
        self._tell(events)

    def _step(self, events: Sequence[phy.Event], end: int) -> None:
        """Process everything that follows from a block, in lock-step."""
        self._deliver(events, end)
        if self._listener is not None:
            self._listener.advance(self.now())
            while self._turn() == 0:
                pass

    def _tell(self, events: Sequence[phy.Event]) -> None:
        rate = self._params.rate_hz
        heard = [
            Heard(event.data, event.burst.start / rate, event.burst.snr_db, event.at / rate)
            for event in events
            if isinstance(event, phy.PduHeard)
        ]
        if heard and self._listener is not None:
            self._listener.heard(heard)

    async def _send_when_due(self) -> None:
        """Send one burst at a time, each decided at the last moment, forever."""
        paced = self._can.paced
        while True:
            self._moved.clear()
            wait_s = self._turn()
            if not wait_s:
                await asyncio.sleep(0)
                continue
            limit_s = max(TIMER_S, wait_s) if paced and wait_s != INFINITE else None
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(limit_s):
                    await self._moved.wait()

    def _turn(self) -> float:
        """Send the next burst if it may leave; returns 0, or the time in s until one may leave."""
        listener, rate = self._listener, self._params.rate_hz
        can_send = self._state == "up" and self._can.transmits
        if listener is None or self._rx is None or not can_send:
            return INFINITE
        if self._is_gone or (self._began_s is not None and not self._clock.end):
            # Wait for a block: the first one shows where the stream starts on our clock.
            self._rx.wakes = True
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
            self._receiving.sensed,
        )
        if self._can.paced:
            tempo = self._tx.tempo
            opportunity = opportunity._replace(
                made_by=lambda start: tempo.samples_in(start - now) / rate
            )
        burst = listener.next_burst(opportunity)
        if self._can.paced:
            self._rx.wakes = burst is None
        if burst is None:
            # Messages that may not leave yet are checked again with the next block. But a partly
            # filled PDU may have started to wait for more messages.
            wait_s = listener.next_wakeup(now) - now
            return wait_s if wait_s > 0 else INFINITE
        start = round(burst.start * rate)
        self._plan.commit(start, self._airtimes.samples(burst.mcs, len(burst.pdus)))
        self._tx.send(burst, start)
        return 0.0

    def _left(self, burst: Burst, report: BurstReport) -> None:
        """Handle the outcome of a burst: adapt the lead, and inform the listener."""
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
        self._moved.set()
