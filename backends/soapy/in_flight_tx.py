"""Bursts handed to a radio process, until it has answered and the stream has passed their end."""

import asyncio

from backends.base import TxOutcome, TxReport
from backends.outstanding import NEVER
from backends.soapy.protocol import TxDone


class InFlightTx:
    """The pending bursts by number. Only `is_due` may be called outside the event loop."""

    def __init__(self) -> None:
        self._waiting: dict[int, tuple[TxReport, asyncio.Future[TxReport]]] = {}
        self._sent: list[tuple[TxReport, asyncio.Future[TxReport]]] = []
        self._first_end = NEVER
        self._number = 0
        self.counters = {"late": 0, "underflows": 0}

    def next_number(self) -> int:
        """Return the number of the next burst; no number is used twice."""
        self._number += 1
        return self._number

    def wait(self, number: int, start: int, n: int) -> asyncio.Future[TxReport]:
        """Register burst `number`, `n` samples at index `start`; returns its future report."""
        answer: asyncio.Future[TxReport] = asyncio.get_running_loop().create_future()
        self._waiting[number] = TxReport(TxOutcome.LOST, start, start + n), answer
        return answer

    def completed(self, told: TxDone, base: int) -> None:
        """Process the answer to a burst; its indices count from `base`."""
        report = TxReport(TxOutcome(told.outcome), told.start + base, told.end + base)
        self.counters["late"] += report.outcome is TxOutcome.LATE
        self.counters["underflows"] += report.outcome is TxOutcome.UNDERFLOW
        waiting = self._waiting.pop(told.number, None)
        if waiting is None:
            return
        if report.outcome is TxOutcome.SENT:
            self._sent.append((report, waiting[1]))
            self._first_end = min(self._first_end, report.end)
        else:
            _answer(waiting[1], report)

    def is_due(self, index: int) -> bool:
        """Whether `settle` would report a burst; may be called from any thread."""
        return self._first_end <= index

    def settle(self, index: int) -> None:
        """Report the bursts that ended before `index`: the stream has passed them."""
        if not self.is_due(index):
            return
        over = [each for each in self._sent if each[0].end <= index]
        self._sent = [each for each in self._sent if each[0].end > index]
        self._first_end = min((report.end for report, _ in self._sent), default=NEVER)
        for report, answer in over:
            _answer(answer, report)

    def lose(self) -> None:
        """Report all bursts, as no more answers will come: those sent as sent, others as lost."""
        unsure, self._waiting = self._waiting, {}
        for report, answer in [*self._sent, *unsure.values()]:
            _answer(answer, report)
        self._sent, self._first_end = [], NEVER


def _answer(answer: asyncio.Future[TxReport], report: TxReport) -> None:
    if not answer.done():
        answer.set_result(report)
