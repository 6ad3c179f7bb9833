"""The modem: PDUs to bursts at the last moment, samples to PDUs, off the event loop."""

import asyncio
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import phy
from backends import BackendError, Radio, Samples, Tuning, TxBurst, TxOutcome
from sdrlinkd.config import ModemParams
from sdrlinkd.errors import UserError
from sdrlinkd.link import Burst, Outcome
from sdrlinkd.modem.clock import StreamClock
from sdrlinkd.modem.plan import AirPlan
from sdrlinkd.modem.rx_thread import ReceiverThread
from sdrlinkd.pdulink import Heard, Opportunity, PduListener
from sdrlinkd.reports import CarrierReport

OUTCOMES = {
    TxOutcome.SENT: Outcome.SENT,
    TxOutcome.LATE: Outcome.LATE,
    TxOutcome.UNDERFLOW: Outcome.UNDERFLOW,
    TxOutcome.LOST: Outcome.LOST,
}

TIMER_S = 0.001
"""The event loop's timers count in this; shorter waits would be busy ones."""
HANDOVER_S = 0.001
"""A burst composed for a free air begins so much later: time to modulate it."""


class ModemLink:
    """A PDU link over a radio: the PHY in two threads, everything else on the event loop."""

    def __init__(self, params: ModemParams, pdu_size: int, radio: Radio, kind: str) -> None:
        self._params = params
        self._pdu_size = pdu_size
        self._radio = radio
        self._kind = kind
        self._transmitter = phy.Transmitter(params.network)
        self._receiver = phy.Receiver(params.network, params.max_cfo_hz / params.rate_hz)
        self._amplitude = 10 ** (-params.backoff_db / 20)
        self._max_pdus = phy.most_pdus(
            phy.OFDM_64_16, params.mcs, pdu_size, round(params.max_burst_s * params.rate_hz)
        )
        paced = radio.capabilities.paced
        self._clock = StreamClock(params.rate_hz, paced)
        self._plan = AirPlan(
            round((HANDOVER_S + radio.capabilities.lead_s) * params.rate_hz),
            round(params.tx_lead_s * params.rate_hz),
        )
        self._planned_start = 0
        self._rx: ReceiverThread | None = None
        self._tx_thread = ThreadPoolExecutor(1, "phy-tx")
        self._listener: PduListener | None = None
        self._tasks: asyncio.TaskGroup | None = None
        self._on_air: list[Burst] = []
        self._moved = asyncio.Event()
        self._state = "down"
        self._problem = ""
        self._bursts_slipped = 0
        self._samples_sent = 0

    def now(self) -> float:
        """Seconds on the received stream."""
        return self._clock.now(time.monotonic())

    async def open(self, listener: PduListener) -> None:
        """Load the compiled code and open the radio."""
        loop = asyncio.get_running_loop()
        await loop.run_in_executor(self._tx_thread, phy.warm_up)
        tuning = Tuning(self._params.rate_hz, self._params.frequency_hz)
        try:
            await self._radio.open(tuning)
        except BackendError as error:
            raise UserError(str(error)) from None
        self._rx = ReceiverThread(
            self._receiver,
            self._params.rate_hz,
            self._deliver,
            every_block=not self._radio.capabilities.paced,
        )
        self._listener = listener
        self._state = "up"

    async def run(self) -> None:
        """Receive, and send what is handed over, until cancelled."""
        if self._rx is None:
            raise RuntimeError("run before open")
        async with asyncio.TaskGroup() as self._tasks:
            try:
                await self._receive(self._rx)
            except BackendError as error:
                self._state, self._problem = "down", str(error)
            await asyncio.Event().wait()

    async def opportunity(self) -> Opportunity:
        """When what is committed to the air is less than the lead."""
        await asyncio.sleep(0)
        while not self._can_send():
            self._moved.clear()
            await self._moved.wait()
        rate = self._params.rate_hz
        while wait := self._plan.wait(self._clock.index(time.monotonic())):
            self._moved.clear()
            if self._radio.capabilities.paced:
                await asyncio.sleep(max(TIMER_S, wait / rate))
            else:
                await self._moved.wait()
        self._planned_start = self._plan.start(self._clock.index(time.monotonic()))
        return Opportunity(self._planned_start / rate, self._max_pdus)

    def send(self, burst: Burst) -> None:
        """Take a burst for the opportunity just given."""
        if self._tasks is None or self._listener is None:
            return
        n_samples = phy.layout(
            phy.OFDM_64_16, self._params.mcs, len(burst.pdus), self._pdu_size
        ).n_samples
        self._plan.commit(self._planned_start, n_samples)
        self._on_air.append(burst)
        self._tasks.create_task(self._transmit(burst, self._planned_start))

    async def idle(self) -> None:
        """Wait until every burst taken is settled."""
        while self._on_air:
            self._moved.clear()
            await self._moved.wait()

    async def close(self) -> None:
        """Close the radio; what has not left is lost."""
        await self._radio.close()
        listener, self._listener = self._listener, None
        if listener is not None:
            for burst in self._on_air:
                listener.settled(burst, Outcome.LOST, self.now())
        self._on_air.clear()
        self._state = "down"
        if self._rx is not None:
            self._rx.stop()
        self._tx_thread.shutdown(wait=True, cancel_futures=True)

    def report(self) -> CarrierReport:
        """State, counters of radio and receiver, and whether the PHY keeps up."""
        params = self._params
        counted = self._receiver.counters
        ratio = self._realtime_ratio
        return CarrierReport(
            kind=self._kind,
            state=self._state,
            detail=f"{phy.MCS_TABLE[params.mcs].name}, {params.rate_hz / 1e6:g} Msps, "
            f"{self._radio.detail}",
            counters={
                **self._radio.counters,
                "bursts_slipped": self._bursts_slipped,
                "samples_sent": self._samples_sent,
                **{name: counted[name] for name in phy.COUNTERS},
            },
            realtime_ratio=round(ratio, 2) if ratio else None,
            notices=self._notices(),
        )

    def _notices(self) -> list[str]:
        notices = [self._problem] if self._problem else []
        if self._radio.counters.get("overflows"):
            notices.append(self._overflow_notice())
        if self._state != "down" and not self._radio.capabilities.transmits:
            notices.append("this radio only receives: what is to be sent stays in the queue")
        return notices

    def _overflow_notice(self) -> str:
        counted = self._radio.counters
        lost = counted["samples_lost"]
        kept = 1 - lost / max(1, self._clock.end)
        return (
            f"the receiver fell behind {counted['overflows']} times and lost {lost} samples: it "
            f"keeps up with {kept:.2f} of real time at {self._params.rate_hz / 1e6:g} Msps "
            f"(demodulation alone with {self._realtime_ratio:.2f}); lower modem.rate_hz"
        )

    @property
    def _realtime_ratio(self) -> float:
        return self._rx.load.realtime_ratio if self._rx is not None else 0.0

    def _can_send(self) -> bool:
        return (
            self._tasks is not None and self._state == "up" and self._radio.capabilities.transmits
        )

    async def _receive(self, receiver: ReceiverThread) -> None:
        """Take blocks from the radio; when the receiver is far behind, the radio has to wait."""
        self._moved.set()
        async for block in self._radio.blocks():
            if self._radio.capabilities.paced:
                self._clock.observe(block.index + block.n, block.host_ns * 1e-9)
                self._moved.set()
            await receiver.put(block)
        await receiver.finish()
        self._state = "ended"
        self._moved.set()

    def _deliver(self, events: Sequence[phy.Event], end: int) -> None:
        """Events that the samples before index `end` completed."""
        if not self._radio.capabilities.paced:
            # Blocks wait for the receiver, and the clock with them.
            self._clock.observe(end, time.monotonic())
            self._moved.set()
        rate = self._params.rate_hz
        heard = [
            Heard(event.data, event.burst.start / rate, event.burst.snr_db)
            for event in events
            if isinstance(event, phy.PduHeard)
        ]
        if heard and self._listener is not None:
            self._listener.heard(heard)

    async def _transmit(self, burst: Burst, planned: int) -> None:
        if self._listener is None:
            return
        loop = asyncio.get_running_loop()
        try:
            samples = await loop.run_in_executor(self._tx_thread, self._modulate, burst.pdus)
            self._samples_sent += len(samples)
            report = await self._radio.send(TxBurst(planned, samples))
            self._bursts_slipped += report.start > planned
            outcome, end = OUTCOMES[report.outcome], report.end
        except BackendError as error:
            outcome, end = Outcome.LOST, planned
            self._problem = str(error)
        if self._listener is not None:
            self._on_air.remove(burst)
            self._listener.settled(burst, outcome, end / self._params.rate_hz)
        self._moved.set()

    def _modulate(self, pdus: Sequence[bytes]) -> Samples:
        """In the transmitter's thread: the burst, with room for its peaks."""
        samples: Samples = self._transmitter.modulate(pdus, self._params.mcs) * self._amplitude
        return samples
