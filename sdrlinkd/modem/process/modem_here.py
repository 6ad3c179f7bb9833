"""A radio, its receiver and its modulator, run by the event loop of this process."""

import asyncio
import math
import time
from collections.abc import Awaitable, Callable, Sequence
from functools import partial
from typing import NoReturn

import phy
from backends import (
    BackendError,
    Capabilities,
    LateRadio,
    Radio,
    RefusalError,
    RelaxingRadio,
    RxBlock,
    Tuning,
)
from sdrlinkd.config import ModemParams
from sdrlinkd.link import Sensed
from sdrlinkd.modem.clock import BlockTimes, Seen, StreamClock
from sdrlinkd.modem.modem import BurstOrder, ModemStatus, ModemUser
from sdrlinkd.modem.process.observer import Observer
from sdrlinkd.modem.process.receiving import Call, Demodulation, ReceiverHere, ReceiverThread
from sdrlinkd.modem.process.sensing_receiver import PATIENCE_S, SensingReceiver
from sdrlinkd.modem.process.transmission import Transmission
from sdrlinkd.pdulink import Heard, Observe

MISSES_PER_S = 1000
"""Acquisitions a second that may bring nothing: a tenth of a core."""
OTHERS_S = 10.0
"""Time in s for which a link of another network or PDU length is told."""


async def forever() -> NoReturn:
    """Wait until cancelled."""
    await asyncio.get_running_loop().create_future()
    raise AssertionError("unreachable")


class ModemHere:
    """A modem on `radio`; samples are processed off the event loop, or on it in lock-step.

    `listens`: whether the receiver senses if the channel is busy. `began_s`: start of the stream's
    time on the monotonic clock; None: time starts with the samples. `load` compiles or loads the
    PHY. PDUs are delivered by `call`; None: on the event loop. `on_block` is called when `seen` and
    `sensed` have changed, on the thread that demodulates. `asks` says before each block whether
    `delivered` is to be called even without PDUs; None: `wakes` says so.
    """

    def __init__(
        self,
        params: ModemParams,
        pdu_size: int,
        radio: Radio,
        listens: bool,
        began_s: float | None,
        load: Callable[[str], Awaitable[None]],
        call: Call | None = None,
        on_block: Callable[[], None] = lambda: None,
        asks: Callable[[], bool] | None = None,
    ) -> None:
        self._params = params
        self._pdu_size = pdu_size
        self._began_s = began_s
        self._radio = radio if began_s is None else LateRadio(radio, self._first_index)
        self._listens = listens
        self._load = load
        self._call = call
        self._on_block = on_block
        self._asks = asks
        self._times = BlockTimes(params.rate_hz)
        self._clock = StreamClock(params.rate_hz, paced=True, began_s=began_s)
        self._receiver: phy.Receiver | None = None
        self._receiving: SensingReceiver | None = None
        self._rx: Demodulation | None = None
        self._tx: Transmission | None = None
        self._user: ModemUser | None = None
        self._may_relax = False

    @property
    def wakes(self) -> bool:
        """Whether `delivered` is called for every block, even without PDUs."""
        return self._rx is not None and self._rx.wakes

    @wakes.setter
    def wakes(self, value: bool) -> None:
        if self._rx is not None:
            self._rx.wakes = value

    @property
    def seen(self) -> Seen | None:
        """The last block; None: no block yet."""
        return self._times.seen

    @property
    def sensed(self) -> Sensed:
        """The state of the channel after the last block."""
        return Sensed() if self._receiving is None else self._receiving.sensed

    @property
    def trouble(self) -> str:
        """Why the radio delivers nothing now, if it knows."""
        return self._radio.trouble

    @property
    def status(self) -> ModemStatus:
        """Radio, counters and load."""
        radio = self._radio
        levels, counters = radio.levels, dict(radio.counters)
        if self._tx is not None:
            counters |= self._tx.counters
        if self._receiver is not None:
            counters |= dict(zip(phy.COUNTERS, self.receiver_counters, strict=True))
        return ModemStatus(
            radio.detail,
            radio.trouble,
            None if levels is None else levels.power_dbfs,
            0.0 if levels is None else levels.clipped,
            counters,
            0.0 if self._rx is None else self._rx.load.realtime_ratio,
            lines=[] if self._receiving is None else self._receiving.lines,
            others=self._others(),
        )

    @property
    def receiver_counters(self) -> list[int]:
        """The receiver's counters, in the order of `phy.COUNTERS`."""
        counters = {} if self._receiving is None else self._receiving.counters
        return [counters.get(name, 0) for name in phy.COUNTERS]

    @property
    def n_samples(self) -> int:
        """Samples received, without gaps."""
        return 0 if self._receiver is None else self._receiver.counters["samples"]

    async def open(self) -> Capabilities:
        """Load the PHY, open the radio, and return what it can do. Raises BackendError."""
        params = self._params
        await self._load(params.engine)
        await self._radio.open(Tuning(params.rate_hz, params.centre_hz))
        can = self._radio.capabilities
        receiver = self._receiver = phy.Receiver(
            params.network,
            params.searched_cfo_hz / params.rate_hz,
            phy.GRIDS[params.grid],
            centre_cycles=params.centre_hz / params.rate_hz if params.one_crystal else 0.0,
            expected=self._expected(),
        )
        patience = math.ceil(PATIENCE_S * params.rate_hz)
        sense = phy.EnergyDetector(params.carrier_db, patience=patience) if self._listens else None
        receiving = self._receiving = SensingReceiver(receiver, sense, params.rate_hz)
        self._tx = Transmission(params, self._radio, self._index if can.paced else None)
        if can.lockstep:
            self._rx = ReceiverHere(receiving, params.rate_hz, self._deliver)
        else:
            self._rx = ReceiverThread(
                receiving, params.rate_hz, self._deliver, not can.paced, self._call
            )
        return can

    async def run(self, user: ModemUser) -> None:
        """Receive and send until cancelled."""
        if self._rx is None or self._tx is None:
            raise RuntimeError("run before open")
        self._user = user
        async with asyncio.TaskGroup() as tasks:
            self._tx.start(tasks, user.left)
            try:
                await self._receive(self._rx)
            except BackendError as error:
                user.ended(str(error), isinstance(error, RefusalError))
            else:
                user.ended("", is_refusal=False)
            # Bursts are still reported.
            await forever()

    def send(self, order: BurstOrder) -> None:
        """Send a burst; `left` follows."""
        if self._tx is None:
            raise RuntimeError("send before open")
        self._tx.send(order)

    def observe(self, tell: Observe | None) -> None:
        """Call `tell` with what is on the air, by `call`; None: no longer."""
        receiving, receiver = self._receiving, self._receiver
        if receiving is None or receiver is None:
            return
        if receiving.observer is not None:
            receiving.observer.stop()
            receiving.observer = None
        if tell is not None:
            params, call = self._params, self._call
            told = tell if call is None else partial(call, tell)
            grid = phy.GRIDS[params.grid]
            receiving.observer = Observer(
                receiver, grid, params.rate_hz, lambda: receiving.lines, told
            )

    async def close(self) -> None:
        """Close the radio; bursts that have not left are not reported. Closing twice is fine."""
        await self._radio.close()
        if self._rx is not None:
            self._rx.stop()
        if self._tx is not None:
            self._tx.close()

    def _others(self) -> list[phy.OtherLink]:
        """Other links that were heard lately."""
        if self._receiver is None:
            return []
        return self._receiver.others(round(OTHERS_S * self._params.rate_hz))

    def _expected(self) -> phy.Expected:
        """What the headers of this link may tell, and how many others are followed a second."""
        params, size = self._params, self._pdu_size
        one = phy.layout(phy.GRIDS[params.grid], 0, 1, size).n_samples
        longest = max(one, round(params.max_burst_s * params.rate_hz))
        return phy.Expected(size, longest, every=round(params.rate_hz / MISSES_PER_S))

    def _first_index(self) -> int:
        """Index of the radio's first sample on the clock that began at `began_s`."""
        if self._began_s is None or self._radio.capabilities.lockstep:
            return 0
        return self._index()

    def _index(self) -> int:
        """Index of the sample that is on the air now."""
        now_s = self._clock.now(self._times.seen, time.monotonic())
        return round(now_s * self._params.rate_hz)

    async def _receive(self, receiver: Demodulation) -> None:
        """Take blocks from the radio, which has to wait if the receiver falls far behind."""
        paced = self._radio.capabilities.paced

        def hear(block: RxBlock) -> None:
            """Demodulate a block on the radio's thread."""
            self._times.observe(block.index + block.n, block.host_ns * 1e-9)
            if self._asks is not None:
                receiver.wakes = self._asks()
            receiver.hear(block)
            self._on_block()
            self._relax()

        async for block in self._radio.blocks(hear if paced else None):
            if paced:
                self._times.observe(block.index + block.n, block.host_ns * 1e-9)
            await receiver.put(block)
        await receiver.finish()

    def _relax(self) -> None:
        """Tell the radio whether its blocks may be longer, if that has changed."""
        may_relax = not self._listens and not self.wakes
        if may_relax != self._may_relax:
            self._may_relax = may_relax
            if isinstance(self._radio, RelaxingRadio):
                self._radio.relax(may_relax)

    def _deliver(self, pdus: Sequence[phy.PduHeard], end: int) -> None:
        """Pass on the PDUs that the samples before index `end` completed."""
        if not self._radio.capabilities.paced:
            # Without pace, blocks wait for the receiver, and so does the clock.
            self._times.observe(end, time.monotonic())
        # Whoever hears of the PDUs decides by the state of the channel after them.
        self._on_block()
        rate = self._params.rate_hz
        heard = [
            Heard(
                pdu.data, pdu.burst.start / rate, pdu.snr_db, pdu.at / rate,
                None if pdu.doppler is None else pdu.doppler * rate,
            )
            for pdu in pdus
        ]  # fmt: skip
        if self._user is not None:
            self._user.delivered(heard, end)
