"""Forecasts when the next message of a periodic topic is due."""

from dataclasses import dataclass
from math import inf
from typing import NamedTuple

from sdrlinkd.link.qos import Qos

MEMORY = 16
"""Effective number of messages that the estimate remembers."""
LEARNED = 3
"""Number of messages from which a period is trusted."""
STEADY = 0.2
"""Largest jitter of a periodic topic, as a share of its period."""
FASTEST_S = 0.002
"""Shortest period in s for which airtime is kept free."""
MISSED = 3
"""Number of periods without a message after which a topic has ended."""
MOST = 128
"""Largest number of topics that are tracked; the topics heard last are kept."""
AT_LEAST_S = 1e-4
"""Time in s that is added to a topic's jitter."""


class Flow(NamedTuple):
    """Messages of a topic of robot `src`, as robot `node` sends or relays them."""

    node: int
    src: int
    topic_id: int


@dataclass(slots=True, eq=False)
class Forecast:
    """The period and phase of one topic: a line through its messages' times.

    The line is tracked by a growing-memory α–β filter; `jitter_s` is the mean distance from it.
    """

    qos: Qos
    seen_at: float
    n_pdus: int = 1
    """PDUs that the last message needed."""
    n: int = 1
    beat_at: float = 0.0
    period_s: float = 0.0
    jitter_s: float = 0.0

    def note(self, qos: Qos, at: float) -> None:
        """Update the line with a message of class `qos` that came at `at`."""
        self.qos = qos
        step_s, self.seen_at = at - self.seen_at, at
        if self.n == 1 or step_s <= 0 or step_s > 2 * MISSED * max(self.period_s, FASTEST_S):
            # Start over on the second message, two messages at once, or a long pause.
            self.n, self.beat_at, self.jitter_s = (2 if step_s > 0 else 1), at, 0.0
            self.period_s = step_s if self.n == 2 else 0.0
            return
        beats = max(1, round((at - self.beat_at) / self.period_s))
        error_s = at - (self.beat_at + beats * self.period_s)
        self.n = min(self.n + 1, MEMORY)
        n = self.n
        self.beat_at += beats * self.period_s + error_s * (4 * n - 2) / (n * (n + 1))
        self.period_s += 6 / (n * (n + 1)) * error_s / beats
        self.jitter_s += (abs(error_s) - self.jitter_s) / n
        if self.period_s < FASTEST_S / 2:
            self.n = 1

    @property
    def is_periodic(self) -> bool:
        """Whether the time of the next message can be predicted."""
        return (
            self.n >= LEARNED
            and self.period_s >= FASTEST_S
            and self.jitter_s <= STEADY * self.period_s
        )

    def is_alive(self, now: float) -> bool:
        """Whether more messages of the topic are expected."""
        return now - self.seen_at <= MISSED * self.period_s

    @property
    def spread_s(self) -> float:
        """Time in s by which a message may come before or after its predicted time."""
        return self.jitter_s + AT_LEAST_S

    def is_late(self, now: float) -> bool:
        """Whether a message is overdue, so that it may come at any time."""
        over_s = now - self.beat_at - self.period_s
        return self.spread_s < over_s < self.period_s / 2

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
        next_at = self.beat_at + self.period_s
        while next_at + self.spread_s < now:
            next_at += self.period_s
        return next_at


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
