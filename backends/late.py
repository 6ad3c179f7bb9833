"""A radio on a clock that began before it."""

from collections.abc import AsyncIterator, Awaitable, Callable
from dataclasses import replace
from time import monotonic_ns

from backends.base import Capabilities, Hear, Levels, Radio, RxBlock, Tuning, TxBurst, TxReport

NOT_OPEN = "the radio was not open yet"


class LateRadio:
    """`radio`, whose first sample others see at index `first()`; what lies before it is a gap.

    `first` is asked when the stream begins.
    """

    def __init__(self, radio: Radio, first: Callable[[], int]) -> None:
        self._radio = radio
        self._ask_first = first
        self._first = 0

    @property
    def capabilities(self) -> Capabilities:
        """The radio's."""
        return self._radio.capabilities

    @property
    def counters(self) -> dict[str, int]:
        """The radio's."""
        return self._radio.counters

    @property
    def detail(self) -> str:
        """The radio's."""
        return self._radio.detail

    @property
    def trouble(self) -> str:
        """The radio's."""
        return self._radio.trouble

    @property
    def levels(self) -> Levels | None:
        """The radio's."""
        return self._radio.levels

    async def open(self, tuning: Tuning) -> None:
        """Begin. Raises BackendError."""
        await self._radio.open(tuning)

    async def blocks(self, hear: Hear | None = None) -> AsyncIterator[RxBlock]:
        """The gap, then the radio's blocks."""
        first = self._first = self._ask_first()

        def hear_shifted(block: RxBlock) -> None:
            if hear is not None:
                hear(replace(block, index=block.index + first))

        if first:
            gap = RxBlock(0, first, None, NOT_OPEN, monotonic_ns())
            if hear is None:
                yield gap
            else:
                hear(gap)
        async for block in self._radio.blocks(None if hear is None else hear_shifted):
            yield replace(block, index=block.index + first)

    def send(self, burst: TxBurst) -> Awaitable[TxReport]:
        """The burst at the radio's own index."""
        first = self._first
        latest = None if burst.latest is None else burst.latest - first
        answer = self._radio.send(burst._replace(start=burst.start - first, latest=latest))
        return self._report(answer, first)

    async def close(self) -> None:
        """Stop."""
        await self._radio.close()

    async def _report(self, answer: Awaitable[TxReport], first: int) -> TxReport:
        report = await answer
        return report._replace(start=report.start + first, end=report.end + first)
