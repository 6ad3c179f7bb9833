"""A radio with offset tuning: its LO leakage falls outside the channel."""

from collections.abc import AsyncIterator, Awaitable
from dataclasses import replace

import numpy as np

from backends.base import (
    Capabilities,
    Hear,
    Levels,
    Radio,
    RelaxingRadio,
    RxBlock,
    Samples,
    Tuning,
    TxBurst,
    TxReport,
)

UP = np.array([1, 1j, -1, -1j], np.complex64)
"""A turn of a quarter of the sample rate: four samples long, the cheapest shift there is."""


class OffsetRadio:
    """`radio` tuned a quarter of its rate below the channel; callers see the channel at 0 Hz.

    The channel must be narrower than half the rate.
    """

    def __init__(self, radio: Radio) -> None:
        self._radio = radio
        self._down = _Turns(UP.conj())
        self._up = _Turns(UP)

    @property
    def capabilities(self) -> Capabilities:
        """What the wrapped radio can do."""
        return self._radio.capabilities

    @property
    def counters(self) -> dict[str, int]:
        """Counters of the wrapped radio."""
        return self._radio.counters

    @property
    def detail(self) -> str:
        """One line for people from the wrapped radio."""
        return self._radio.detail

    @property
    def trouble(self) -> str:
        """Why the wrapped radio delivers nothing, if it knows."""
        return self._radio.trouble

    @property
    def levels(self) -> Levels | None:
        """Level of the samples that the wrapped radio receives."""
        return self._radio.levels

    async def open(self, tuning: Tuning) -> None:
        """Open the wrapped radio with its oscillator below the channel. Raises BackendError."""
        beside_hz = tuning.frequency_hz - tuning.rate_hz / 4
        await self._radio.open(replace(tuning, frequency_hz=beside_hz))

    async def blocks(self, hear: Hear | None = None) -> AsyncIterator[RxBlock]:
        """Yield the wrapped radio's blocks, shifted so that the channel is at 0 Hz."""

        def hear_shifted(block: RxBlock) -> None:
            if hear is not None:
                hear(self._shifted(block))

        async for block in self._radio.blocks(None if hear is None else hear_shifted):
            yield self._shifted(block)

    def send(self, burst: TxBurst) -> Awaitable[TxReport]:
        """Send a burst in the channel; its shift starts with phase 0 at its first sample."""
        samples = burst.samples * self._up.of(0, len(burst.samples))
        return self._radio.send(burst._replace(samples=samples))

    def relax(self, may_relax: bool) -> None:
        """Tell the wrapped radio whether its blocks may be longer."""
        if isinstance(self._radio, RelaxingRadio):
            self._radio.relax(may_relax)

    async def close(self) -> None:
        """Close the wrapped radio; closing twice is fine."""
        await self._radio.close()

    def _shifted(self, block: RxBlock) -> RxBlock:
        if block.samples is None:
            return block
        return replace(block, samples=block.samples * self._down.of(block.index, block.n))


class _Turns:
    """A periodic rotation of samples, for any range of indices."""

    def __init__(self, turn: Samples) -> None:
        self._turn = self._many = turn

    def of(self, index: int, n: int) -> Samples:
        """Factors for `n` samples from `index` on."""
        first = index % len(self._turn)
        if len(self._many) < first + n:
            self._many = np.tile(self._turn, 1 + (first + n) // len(self._turn))
        return self._many[first : first + n]
