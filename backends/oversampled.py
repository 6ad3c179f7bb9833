"""A radio at twice or four times the modem's rate, for devices that cannot run as slowly."""

from collections.abc import AsyncIterator, Awaitable, Iterator
from dataclasses import replace

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
from backends.outstanding import GAP
from phy import REACH, Downsampler, upsample

TRIM = GAP // 2
"""Samples cut from the filter's rise and fall, almost 0: bursts GAP apart stay separate."""


class OversampledRadio:
    """`radio` at `factor` times the rate that callers see; indices count at the callers' rate."""

    def __init__(self, radio: Radio, factor: int) -> None:
        self._radio = radio
        self._factor = factor
        self._down = Downsampler(factor)
        self._tuning: Tuning | None = None
        self._last_ns = 0

    @property
    def capabilities(self) -> Capabilities:
        """What the wrapped radio can do; the filter lengthens bursts, so the lead is longer."""
        found = self._radio.capabilities
        return replace(found, lead_s=found.lead_s + self._reach_s)

    @property
    def counters(self) -> dict[str, int]:
        """Counters of the wrapped radio; samples count at the callers' rate."""
        counted = self._radio.counters
        lost = counted.get("samples_lost", 0)
        return {**counted, "samples_lost": lost // self._factor} if lost else counted

    @property
    def detail(self) -> str:
        """One line for people from the wrapped radio, with the oversampling factor."""
        return f"{self._radio.detail}, {self._factor} times oversampled"

    @property
    def trouble(self) -> str:
        """Why the wrapped radio delivers nothing, if it knows."""
        return self._radio.trouble

    @property
    def levels(self) -> Levels | None:
        """Level of the samples that the wrapped radio receives, before our filter."""
        return self._radio.levels

    async def open(self, tuning: Tuning) -> None:
        """Open the wrapped radio at `factor` times the rate. Raises BackendError."""
        self._tuning = tuning
        await self._radio.open(replace(tuning, rate_hz=tuning.rate_hz * self._factor))

    async def blocks(self, hear: Hear | None = None) -> AsyncIterator[RxBlock]:
        """Yield blocks with a delay of REACH samples; a gap ends the filter as silence would."""

        def hear_filtered(block: RxBlock) -> None:
            if hear is not None:
                for each in self._filtered(block):
                    hear(each)

        async for block in self._radio.blocks(None if hear is None else hear_filtered):
            for each in self._filtered(block):
                yield each
        if len(rest := self._down.flush()):
            index = self._down.next_index - len(rest)
            last = RxBlock(index, len(rest), rest, "", self._last_ns)
            if hear is None:
                yield last
            else:
                hear(last)

    def _filtered(self, block: RxBlock) -> Iterator[RxBlock]:
        self._last_ns = block.host_ns
        if block.samples is not None:
            samples = self._down.push(block.samples)
            if len(samples):
                yield self._told(samples, block, block.host_ns - round(self._reach_s * 1e9))
            return
        if len(rest := self._down.flush()):
            yield self._told(rest, block, block.host_ns)
        begin = self._down.next_index
        self._down.restart(block.index + block.n)
        n = self._down.next_index - begin
        yield RxBlock(begin, n, None, block.gap_reason, block.host_ns, self._unsure(block))

    def send(self, burst: TxBurst) -> Awaitable[TxReport]:
        """Send the burst, together with the filter's rise before it and fall after it."""
        samples = upsample(burst.samples, self._factor)[TRIM:-TRIM]
        latest = None if burst.latest is None else self._fast(burst.latest)
        return self._report(self._radio.send(TxBurst(self._fast(burst.start), samples, latest)))

    def _fast(self, start: int) -> int:
        """Index at the radio's rate at which a burst begins."""
        return (start - REACH) * self._factor + TRIM

    async def _report(self, answer: Awaitable[TxReport]) -> TxReport:
        report = await answer
        start = (report.start - TRIM) // self._factor + REACH
        end = (report.end + TRIM) // self._factor - REACH
        return TxReport(report.outcome, start, max(start, end))

    def relax(self, may_relax: bool) -> None:
        """Tell the wrapped radio whether its blocks may be longer."""
        if isinstance(self._radio, RelaxingRadio):
            self._radio.relax(may_relax)

    async def close(self) -> None:
        """Close the wrapped radio; closing twice is fine."""
        await self._radio.close()

    @property
    def _reach_s(self) -> float:
        return REACH / self._tuning.rate_hz if self._tuning else 0.0

    def _told(self, samples: Samples, block: RxBlock, host_ns: int) -> RxBlock:
        index = self._down.next_index - len(samples)
        return RxBlock(index, len(samples), samples, "", host_ns, self._unsure(block))

    def _unsure(self, block: RxBlock) -> int:
        return -(-block.index_uncertainty // self._factor)
