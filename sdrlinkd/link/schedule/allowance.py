"""How many PDUs the next burst may hold, by class."""

from collections.abc import Callable, Collection
from math import inf
from typing import NamedTuple

from sdrlinkd.link.qos import Qos
from sdrlinkd.link.schedule.forecast import Forecasts
from sdrlinkd.link.schedule.params import ClassesParams

ALIVE_S = 1.0
"""Time in s after its last message for which a topic counts as alive."""
OVERRUN = 0.25
"""Share of a PDU by which a burst may end after the time that a message is due, rather than leave
more than that unused."""
SHARED_OVERRUN = 0.9
"""OVERRUN for a shared channel: a robot that finds it free must first wait for its turn, while one
that finds it busy starts as soon as it falls free."""
IDLE_SHARE = 0.1
"""Largest share of airtime that is kept free for messages that are due."""
MOST_IDLE_S = 0.02


class Allowance(NamedTuple):
    """How many PDUs a burst may hold, by class.

    A PDU whose first entry is of class `qos` may join a burst of fewer than `most[qos]` PDUs.
    `owed` lists the classes that get the burst's last PDUs, even if others could fill them. `until`
    is when to query again if the most urgent waiting class gets no PDU.
    """

    most: tuple[int, ...]
    owed: tuple[Qos, ...] = ()
    until: float = inf

    @classmethod
    def of(cls, n_pdus: int) -> "Allowance":
        """An allowance of `n_pdus` for every class."""
        return cls((n_pdus,) * len(Qos))

    def above(self, qos: Qos) -> "Allowance":
        """The allowance for only the classes more urgent than `qos`, with room for one more PDU."""
        return self.more_urgent(qos).fewer(1)

    def more_urgent(self, qos: Qos) -> "Allowance":
        """The allowance for only the classes more urgent than `qos`."""
        most = (n if each < qos else 0 for each, n in zip(Qos, self.most, strict=True))
        return Allowance(tuple(most), until=self.until)

    def fewer(self, n: int) -> "Allowance":
        """This allowance, less `n` PDUs."""
        return self._replace(most=tuple(max(0, each - n) for each in self.most))

    def at_least_one(self, classes: Collection[Qos]) -> "Allowance":
        """This allowance, with at least one PDU for each of these classes."""
        most = (max(n, qos in classes) for qos, n in zip(Qos, self.most, strict=True))
        return self._replace(most=tuple(most))

    def least(self, least: Qos) -> "Allowance":
        """This allowance, except that classes less urgent than `least` may only start a burst."""
        most = (n if qos <= least else min(n, 1) for qos, n in zip(Qos, self.most, strict=True))
        return self._replace(most=tuple(most))


class Limits:
    """Limits of the next burst: caps by class, and airtime kept free for messages that are due."""

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
        *,
        has_slots: bool = False,
    ) -> Allowance:
        """The allowance for a burst that leaves at `start` and is at most `longest_s` long.

        A message can leave `ready_s` after it is due, at the earliest, and is noticed up to
        `notice_s` after it was made. Classes not in `asked` get no PDU. `has_slots`: this robot may
        send only in slots of its own, so what it keeps free is lost until the next one, for what is
        due as well: then nothing is kept free.
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
                # No topic is more urgent, so nothing shortens bursts of this class.
                most.append(most_pdus(longest_s))
                continue
            cap_s = longest_s
            if has_slots or forecasts.is_unforeseen(known, qos, ALIVE_S):
                cap_s = min(cap_s, max(self._cap_s[qos], airtime_s(1)))
            n = most_pdus(cap_s)
            due = None if has_slots else forecasts.next_due(known, qos)
            if due is not None and n:
                free_s = due.due(known) - due.spread_s + ready_s - start
                n = self._before(free_s, 2 * due.spread_s + notice_s, n, airtime_s, overrun)
                passed_at = due.due(known) + due.spread_s + notice_s
                if n == 0 and passed_at <= start:
                    # There is nothing to wait for any more.
                    n = 1
                elif n == 0 and until == inf:
                    until = passed_at
            most.append(n)
        return Allowance(tuple(most), until=until)

    def kept_free(self, passed_s: float) -> None:
        """Note that the channel was idle for `passed_s` because of these limits."""
        self._idle_s = max(0.0, self._idle_s - passed_s)

    def _before(
        self,
        free_s: float,
        wait_s: float,
        most: int,
        airtime_s: Callable[[int], float],
        overrun: float,
    ) -> int:
        """Number of PDUs that fit into `free_s`; 0: wait for the message due then (± `wait_s`)."""
        one_s = airtime_s(1)
        each_s = airtime_s(2) - one_s
        if each_s <= 0:
            return most
        if free_s + overrun * each_s < one_s:
            return 0 if free_s + wait_s < self._idle_s else 1
        return min(most, 1 + int((free_s + overrun * each_s - one_s) / each_s))
