"""A simulated air inside one process, in lock-step: for tests, simulations and benchmarks."""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Mapping

from backends.base import (
    BackendError,
    Capabilities,
    Hear,
    RxBlock,
    Tuning,
    TxBurst,
    TxOutcome,
    TxReport,
)
from backends.ether.antenna import Antenna
from backends.ether.medium import LEAD, Medium
from backends.ether.world import AirParams, RadioParams, World
from backends.outstanding import answered


def lockstep_capabilities(antenna: Antenna, air: AirParams) -> Capabilities:
    """Capabilities of a radio with that antenna on an air in lock-step."""
    return antenna.capabilities(paced=False, lead_s=LEAD / air.rate_hz, block_s=air.block_s)


class LocalEther:
    """Radios on one air; time advances by a block when all radios have finished the current one."""

    def __init__(
        self, air: AirParams, radios: Mapping[int, RadioParams], world: World, seed: int
    ) -> None:
        self.air = air
        self.medium = Medium(air, world, seed)
        self.now = 0.0
        self._steps = 0
        self.radios = {
            node_id: LocalRadio(self, node_id, radio, seed)
            for node_id, radio in sorted(radios.items())
        }
        for node_id, radio in sorted(radios.items()):
            self.medium.join(node_id, radio, 0.0)

    async def run(self, until_s: float) -> None:
        """Advance time to `until_s`."""
        while self.now < until_s:
            self._steps += 1
            self.now = self._steps * self.air.block_s
            pieces = [(radio, self.medium.take(i, self.now)) for i, radio in self.radios.items()]
            for radio, each in pieces:
                for piece in each:
                    radio.queue.put_nowait(radio.antenna.receive(piece, 0))
            for radio in list(self.radios.values()):
                await radio.queue.join()

    def leave(self, node_id: int) -> None:
        """Remove a closed radio, so that no step waits for it."""
        del self.radios[node_id]
        self.medium.leave(node_id)


class LocalRadio:
    """One node's radio in a LocalEther."""

    def __init__(self, ether: LocalEther, node_id: int, radio: RadioParams, seed: int) -> None:
        self._ether = ether
        self._node_id = node_id
        air = ether.air
        self.antenna = Antenna(radio, seed * 256 + node_id, air.rate_hz, air.jammer)
        self.queue: asyncio.Queue[RxBlock | None] = asyncio.Queue()
        self._number = 0
        self._is_open = False
        self.counters: dict[str, int] = {"late": 0}

    @property
    def capabilities(self) -> Capabilities:
        """What this radio can do, according to its parameters."""
        return lockstep_capabilities(self.antenna, self._ether.air)

    @property
    def detail(self) -> str:
        """The kind of air, in one line for people."""
        return "simulated channel in this process"

    @property
    def trouble(self) -> str:
        """Always empty: the air is in this process."""
        return ""

    @property
    def levels(self) -> None:
        """Always None: this radio measures no levels."""
        return None

    async def open(self, tuning: Tuning) -> None:
        """Start the radio. Raises BackendError if its rate is not that of the air."""
        if tuning.rate_hz != self._ether.air.rate_hz:
            raise BackendError(
                f"rate_hz: got {tuning.rate_hz:g}; allowed: {self._ether.air.rate_hz:g}"
            )
        self._is_open = True

    async def blocks(
        self,
        hear: Hear | None = None,  # noqa: ARG002  # there is no thread
    ) -> AsyncIterator[RxBlock]:
        """Yield what is received, one step at a time."""
        while (block := await self.queue.get()) is not None:
            self.antenna.settle(block.index + block.n)
            try:
                yield block
            finally:
                # A reader that requests the next block has finished this one.
                self.queue.task_done()
        self.queue.task_done()

    def send(self, burst: TxBurst) -> Awaitable[TxReport]:
        """Put a burst on the air."""
        if not self._is_open:
            return answered(TxReport(TxOutcome.LOST, burst.start, burst.start))
        self._number += 1
        answer = self.antenna.sent(self._number)
        start = self._ether.medium.send(self._node_id, self.antenna.on_air(burst))
        self.counters["late"] += self.antenna.placed(self._number, start, len(burst.samples))
        return answer

    async def close(self) -> None:
        """Leave the air; closing twice is fine."""
        if self._is_open:
            self._is_open = False
            self._ether.leave(self._node_id)
            while not self.queue.empty():
                self.queue.get_nowait()
                self.queue.task_done()
            self.queue.put_nowait(None)
        self.antenna.lose()
