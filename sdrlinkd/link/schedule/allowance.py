"""How many PDUs the next burst may hold, by the class of what goes next."""

from collections.abc import Callable, Collection
from math import inf
from typing import NamedTuple

from sdrlinkd.link.qos import Qos
from sdrlinkd.link.schedule.forecast import Forecasts
from sdrlinkd.link.schedule.params import ClassesParams

ALIVE_S = 1.0
"""A class has something alive for so long after its last message."""
OVERRUN = 0.25
"""A burst may last beyond the time that a message is due by this share of a PDU, rather than leave
more than that unused."""
SHARED_OVERRUN = 0.9
"""The same where others share the air: who finds it free first has to wait for his turn, and who
finds it busy begins when it falls free."""
IDLE_SHARE = 0.1
"""No more of the air is kept free for what is due."""
MOST_IDLE_S = 0.02


class Allowance(NamedTuple):
    """`most[qos]`: a PDU that begins with that class may join a burst of fewer.

    `owed`: classes that are to have the burst's last PDUs, even if others could fill them.
    `until`: where the most urgent class that waits gets none, it is to be asked again then.
    """

    most: tuple[int, ...]
    owed: tuple[Qos, ...] = ()
    until: float = inf

    @classmethod
    def of(cls, n_pdus: int) -> "Allowance":
        """An allowance of `n_pdus` for every class."""
        return cls((n_pdus,) * len(Qos))

    def above(self, qos: Qos) -> "Allowance":
        """For classes more urgent than `qos` alone, with room for one PDU behind them."""
        most = (max(0, n - 1) if each < qos else 0 for each, n in zip(Qos, self.most, strict=True))
        return Allowance(tuple(most))

    def least(self, least: Qos) -> "Allowance":
        """Classes less urgent than `least` may begin a burst, but not join one."""
        most = (n if qos <= least else min(n, 1) for qos, n in zip(Qos, self.most, strict=True))
        return self._replace(most=tuple(most))


class Limits:
    """Caps by class, and gaps for what is due."""

    def __init__(self, params: ClassesParams, forecasts: Forecasts) -> None:
        self._cap_s = {qos: params.of(qos).max_burst_s or inf for qos in Qos}
        self._forecasts = forecasts
        self._idle_s = MOST_IDLE_S
        self._asked_at = 0.0

    def allow(
        self,
        start: float,
        longest_s: float,
        airtime_s: Callable[[int], float],
        most_pdus: Callable[[float], int],
        ready_s: float,
        notice_s: float,
        is_shared: bool = False,
        asked: Collection[Qos] = tuple(Qos),
    ) -> Allowance:
        """For a burst that leaves at `start` and is no longer than `longest_s`.

        `ready_s` after a message is due, it can leave at the earliest; up to `notice_s` after it
        has come, nobody knows. Classes that nobody `asked` about get none.
        """
        forecasts = self._forecasts
        overrun = SHARED_OVERRUN if is_shared else OVERRUN
        known = start - notice_s
        self._idle_s = min(
            MOST_IDLE_S, self._idle_s + IDLE_SHARE * max(0.0, start - self._asked_at)
        )
        self._asked_at = max(start, self._asked_at)
        most, until = [], inf
        for qos in Qos:
            if qos not in asked:
                most.append(0)
                continue
            if qos <= forecasts.most_urgent:
                # Nothing goes before it, so nothing shortens its bursts.
                most.append(most_pdus(longest_s))
                continue
            cap_s = longest_s
            if forecasts.is_unforeseen(known, qos, ALIVE_S):
                cap_s = min(cap_s, max(self._cap_s[qos], airtime_s(1)))
            n = most_pdus(cap_s)
            due = forecasts.next_due(known, qos)
            if due is not None and n:
                free_s = due.due(known) - due.spread_s + ready_s - start
                n = self._before(free_s, 2 * due.spread_s + notice_s, n, airtime_s, overrun)
                if n == 0 and until == inf:
                    until = due.due(known) + due.spread_s + notice_s
            most.append(n)
        return Allowance(tuple(most), until=until)

    def kept_free(self, passed_s: float) -> None:
        """The air was idle for so long because of this."""
        self._idle_s = max(0.0, self._idle_s - passed_s)

    def _before(
        self,
        free_s: float,
        wait_s: float,
        most: int,
        airtime_s: Callable[[int], float],
        overrun: float,
    ) -> int:
        """PDUs for `free_s`; 0: better wait for what comes then, or `wait_s` later."""
        one_s = airtime_s(1)
        each_s = airtime_s(2) - one_s
        if each_s <= 0:
            return most
        if free_s + overrun * each_s < one_s:
            return 0 if free_s + wait_s < self._idle_s else 1
        return min(most, 1 + int((free_s + overrun * each_s - one_s) / each_s))
