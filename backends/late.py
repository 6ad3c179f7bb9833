"""A radio that joins a sample clock that is already running."""

import threading
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from dataclasses import replace

from backends.base import (
    Capabilities,
    Hear,
    Levels,
    Radio,
    RelaxingRadio,
    RxBlock,
    Tuning,
    TxBurst,
    TxReport,
)

NOT_OPEN = "the radio was not open yet"


class LateRadio:
    """`radio`, with its samples moved to index `first()` and later; the time before is a gap.

    `first` is called when the radio's first block arrives. Nothing is sent before that.
    """

    def __init__(self, radio: Radio, first: Callable[[], int]) -> None:
        self._radio = radio
        self._ask_first = first
        self._first = 0
        self._has_begun = threading.Event()

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
        """Open the wrapped radio. Raises BackendError."""
        await self._radio.open(tuning)

    async def blocks(self, hear: Hear | None = None) -> AsyncIterator[RxBlock]:
        """The gap, then the radio's blocks."""

        def hear_shifted(block: RxBlock) -> None:
            if hear is not None:
                for each in self._shifted(block):
                    hear(each)

        async for block in self._radio.blocks(None if hear is None else hear_shifted):
            for each in self._shifted(block):
                yield each

    def send(self, burst: TxBurst) -> Awaitable[TxReport]:
        """Send the burst at the wrapped radio's own index."""
        first = self._first
        latest = None if burst.latest is None else burst.latest - first
        answer = self._radio.send(burst._replace(start=burst.start - first, latest=latest))
        return self._report(answer, first)

    def relax(self, may_relax: bool) -> None:
        """Tell the wrapped radio whether its blocks may be longer."""
        if isinstance(self._radio, RelaxingRadio):
            self._radio.relax(may_relax)

    async def close(self) -> None:
        """Close the wrapped radio; closing twice is fine."""
        await self._radio.close()

    def _shifted(self, block: RxBlock) -> Iterator[RxBlock]:
        if not self._has_begun.is_set():
            self._has_begun.set()
            self._first = max(0, self._ask_first() - block.index - block.n)
            if self._first:
                yield RxBlock(0, self._first, None, NOT_OPEN, block.host_ns)
        yield replace(block, index=block.index + self._first) if self._first else block

    async def _report(self, answer: Awaitable[TxReport], first: int) -> TxReport:
        report = await answer
        return report._replace(start=report.start + first, end=report.end + first)
