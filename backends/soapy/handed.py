"""Bursts handed to a radio process, until it answers."""

import asyncio

from backends.base import TxOutcome, TxReport
from backends.soapy.protocol import Left


class Handed:
    """By number. Used on the event loop."""

    def __init__(self) -> None:
        self._waiting: dict[int, tuple[TxReport, asyncio.Future[TxReport]]] = {}
        self._number = 0
        self.counters = {"late": 0, "underflows": 0}

    def next_number(self) -> int:
        """Of the next burst."""
        self._number += 1
        return self._number

    def wait(self, number: int, start: int, n: int) -> asyncio.Future[TxReport]:
        """The answer to come."""
        answer: asyncio.Future[TxReport] = asyncio.get_running_loop().create_future()
        self._waiting[number] = TxReport(TxOutcome.LOST, start, start + n), answer
        return answer

    def left(self, told: Left, base: int) -> None:
        """The process has answered, by indices that begin at `base`."""
        report = TxReport(TxOutcome(told.outcome), told.start + base, told.end + base)
        self.counters["late"] += report.outcome is TxOutcome.LATE
        self.counters["underflows"] += report.outcome is TxOutcome.UNDERFLOW
        waiting = self._waiting.pop(told.number, None)
        if waiting is not None and not waiting[1].done():
            waiting[1].set_result(report)

    def lose(self) -> None:
        """None of them will leave."""
        waiting, self._waiting = self._waiting, {}
        for planned, answer in waiting.values():
            if not answer.done():
                answer.set_result(planned)
