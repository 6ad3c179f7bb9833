"""Forecasts when the next message of a periodic topic is due."""

from collections import deque
from collections.abc import Sequence
from itertools import pairwise, takewhile
from math import inf, sqrt
from typing import NamedTuple

from sdrlinkd.link.qos import Qos

MEMORY = 16
"""Number of messages that a forecast is made from."""
LEARNED = 5
"""Number of messages from which a period is trusted."""
STEADY = 0.16
"""Largest mean distance of a periodic topic's steps from a number of periods, in periods."""
NEAR = 0.25
"""Distance of a step from the period, in periods, up to which it is one period long."""
FEW = 7
"""Number of the last messages that tell of another rate, if their steps are EVEN."""
EVEN = 0.05
"""STEADY for FEW messages, as these may seem to be periodic by chance."""
ODD = 6
"""Distance of a step from the period from which on the phase is another one, as a multiple of the
median distance."""
FASTEST_S = 0.002
"""Shortest period in s for which airtime is kept free."""
MISSED = 3
"""Number of periods without a message after which a topic has ended, or paused."""
MOST = 128
"""Largest number of topics that are tracked; the topics heard last are kept."""
AT_LEAST_S = 1e-4
"""Time in s that is added to a topic's jitter."""


class Flow(NamedTuple):
    """Messages of a topic of robot `src`, as robot `node` sends or relays them."""

    node: int
    src: int
    topic_id: int


class Line(NamedTuple):
    """A line through a topic's messages: when the newest was due, period and jitter, in s."""

    beat_at: float
    period_s: float
    jitter_s: float
    is_periodic: bool


class Forecast:
    """The period and phase of one topic.

    Both are computed from the last MEMORY messages alone: the period from the steps between them
    that are about one period long, the phase from the messages since the last step that was not.
    What misleads a forecast is soon gone: a pause with the first message after it, lost and late
    messages at once, another rate with half of MEMORY messages, or with all of them if the rates
    differ by less than NEAR.
    """

    __slots__ = ("_line", "_times", "n_pdus", "qos")

    def __init__(self, qos: Qos, at: float, n_pdus: int = 1) -> None:
        self.qos = qos
        self.n_pdus = n_pdus
        """PDUs that the last message needed."""
        self._times = deque([at], MEMORY)
        self._line: Line | None = None

    def note(self, qos: Qos, at: float) -> None:
        """Take a message of class `qos` that came at `at`, after all before."""
        self.qos = qos
        self._times.append(at)
        self._line = None

    @property
    def seen_at(self) -> float:
        """When the last message came."""
        return self._times[-1]

    @property
    def line(self) -> Line:
        """The line through the last messages."""
        if self._line is None:
            self._line = _line_through([*self._times])
        return self._line

    @property
    def is_periodic(self) -> bool:
        """Whether the time of the next message can be predicted."""
        return self.line.is_periodic

    def is_alive(self, now: float) -> bool:
        """Whether more messages of the topic are expected."""
        return now - self.seen_at <= MISSED * self.line.period_s

    @property
    def spread_s(self) -> float:
        """Time in s by which a message may come before or after its predicted time."""
        return self.line.jitter_s + AT_LEAST_S

    def is_late(self, now: float) -> bool:
        """Whether a message is overdue, so that it may come at any time."""
        line = self.line
        return self.spread_s < now - line.beat_at - line.period_s < line.period_s / 2

    def is_due(self, begin: float, end: float) -> bool:
        """Whether the next message is urgent, and predicted between two times."""
        return (
            self.qos <= Qos.LATENCY
            and self.is_periodic
            and self.is_alive(begin)
            and begin <= self.due(begin) < end
        )

    def due(self, now: float) -> float:
        """Predicted time of the next message; a late one is still expected for `spread_s`."""
        line, spread_s = self.line, self.spread_s
        next_at = line.beat_at + line.period_s
        while next_at + spread_s < now:
            next_at += line.period_s
        return next_at


def _line_through(times: Sequence[float]) -> Line:
    """The line through messages that came at `times`, in s, in ascending order."""
    line = _fitted(times, STEADY)
    return line if line.is_periodic else _fitted(times[-FEW:], EVEN)


def _fitted(times: Sequence[float], most: float) -> Line:
    """The line through `times`, periodic if its steps are off by `most` periods or less."""
    steps = [after - before for before, after in pairwise(times)]
    if not steps:
        return Line(times[-1], 0.0, 0.0, is_periodic=False)
    period_s = _median(steps)
    near = [step_s for step_s in steps if abs(step_s - period_s) <= NEAR * period_s]
    distance_s = _median([abs(step_s - period_s) for step_s in near])
    odd_s = min(NEAR * period_s, ODD * distance_s + AT_LEAST_S)
    single = [step_s for step_s in near if abs(step_s - period_s) <= odd_s]
    period_s = sum(single) / len(single)
    # Longer steps are pauses, which say nothing.
    off = [
        abs(step_s - max(1, round(step_s / period_s)) * period_s)
        for step_s in steps
        if step_s < (MISSED + 0.5) * period_s
    ]
    off_s = sum(off) / len(off)
    is_periodic = (
        len(times) >= LEARNED
        and 2 * len(near) >= len(steps)
        and period_s >= FASTEST_S
        and off_s <= most * period_s
    )
    n = 1 + sum(1 for _ in takewhile(lambda step_s: abs(step_s - period_s) <= odd_s, steps[::-1]))
    in_phase, middle = times[-n:], (n - 1) / 2
    if n > LEARNED:
        # Least squares.
        period_s = 12 * sum((i - middle) * at for i, at in enumerate(in_phase)) / (n**3 - n)
    # A step jitters at both ends.
    return Line(sum(in_phase) / n + middle * period_s, period_s, off_s / sqrt(2), is_periodic)


def _median(values: Sequence[float]) -> float:
    return sorted(values)[(len(values) - 1) // 2]


class Forecasts:
    """The topics of this node and of the nodes it hears, with their forecasts."""

    def __init__(self) -> None:
        self._by_key: dict[Flow, Forecast] = {}
        self.most_urgent = Qos.BULK
        """The most urgent class of any message so far."""

    def note(self, key: Flow, qos: Qos, at: float, n_pdus: int = 1) -> None:
        """Note a message of class `qos` that came at `at` on our clock, and its count of PDUs."""
        if qos < self.most_urgent:
            self.most_urgent = qos
        found = self._by_key.get(key)
        if found is None:
            if len(self._by_key) >= MOST:
                # Bounds the effort if someone forges PDUs of many robots.
                del self._by_key[min(self._by_key, key=lambda each: self._by_key[each].seen_at)]
            self._by_key[key] = Forecast(qos, at, n_pdus)
        elif at > found.seen_at:
            found.note(qos, at)
            found.n_pdus = n_pdus

    def next_due(self, now: float, below: Qos) -> Forecast | None:
        """The periodic topic more urgent than `below` that is due first; None if there is none."""
        first, first_at = None, inf
        for each in self._by_key.values():
            if each.qos < below and each.is_periodic and each.is_alive(now):
                at = each.due(now) - each.spread_s
                if at < first_at:
                    first, first_at = each, at
        return first

    def coming(self, node: int, begin: float, end: float, *, is_relayed: bool) -> dict[Qos, int]:
        """PDUs of each urgent class that robot `node` will have to send between two times.

        `is_relayed`: only of what it relays.
        """
        coming: dict[Qos, int] = {}
        for key, each in self._by_key.items():
            counts = key.node == node and not (is_relayed and key.src == node)
            if counts and each.is_due(begin, end):
                coming[each.qos] = coming.get(each.qos, 0) + each.n_pdus
        return coming

    def of_team(self, begin: float, end: float) -> list[tuple[int, Forecast]]:
        """The urgent messages that come between two times, and the robots that they come from.

        The first one is that which comes first.
        """
        found = [
            (key.node, each)
            for key, each in self._by_key.items()
            if key.node == key.src and each.is_due(begin, end)
        ]
        return sorted(found, key=lambda each: each[1].due(begin) + each[1].spread_s)

    def is_unforeseen(self, now: float, below: Qos, alive_s: float) -> bool:
        """Whether a topic more urgent than `below` is alive and cannot be predicted now."""
        return any(
            each.qos < below
            and now - each.seen_at < alive_s
            and (not each.is_periodic or each.is_late(now))
            for each in self._by_key.values()
        )
