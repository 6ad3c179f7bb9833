"""Bursts handed over whose last sample has not left yet."""

import asyncio

from backends.base import TxOutcome, TxReport


class Outstanding:
    """Answers each burst when the stream has passed its end."""

    def __init__(self) -> None:
        self._waiting: list[tuple[int, asyncio.Future[TxReport]]] = []

    async def left(self, end: int) -> TxReport:
        """Wait until the sample before `end` has left, or all is lost."""
        report: asyncio.Future[TxReport] = asyncio.get_running_loop().create_future()
        self._waiting.append((end, report))
        return await report

    def settle(self, index: int) -> None:
        """Every sample before `index` has left."""
        self._answer(index, TxOutcome.SENT)

    def lose(self) -> None:
        """Nothing more will leave."""
        self._answer(None, TxOutcome.LOST)

    def _answer(self, before: int | None, outcome: TxOutcome) -> None:
        kept = []
        for end, report in self._waiting:
            if before is not None and end > before:
                kept.append((end, report))
            elif not report.done():
                report.set_result(TxReport(outcome, end))
        self._waiting = kept
