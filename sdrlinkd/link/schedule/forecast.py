"""When the next message of a periodic topic is due."""

from collections.abc import Hashable
from dataclasses import dataclass
from math import inf

from sdrlinkd.link.qos import Qos

MEMORY = 16
"""So many messages are remembered, in effect."""
LEARNED = 3
"""From so many on, a period is believed."""
STEADY = 0.2
"""A topic is periodic when its messages come within this share of the period."""
FASTEST_S = 0.002
"""Faster than that, no gap is worth keeping."""
MISSED = 3
"""After so many periods without a message, a topic has ended."""
MOST = 128
"""Topics that are followed, the latest heard."""
AT_LEAST_S = 1e-4
"""Nothing is more punctual than that."""


@dataclass(slots=True, eq=False)
class Forecast:
    """One topic's beat: a line through its messages' times, by growing-memory α–β tracking.

    `jitter_s` is the mean distance from it.
    """

    qos: Qos
    seen_at: float
    n: int = 1
    beat_at: float = 0.0
    period_s: float = 0.0
    jitter_s: float = 0.0

    def note(self, qos: Qos, at: float) -> None:
        """Move the line on by a message of class `qos` that came at `at`."""
        self.qos = qos
        step_s, self.seen_at = at - self.seen_at, at
        if self.n == 1 or step_s <= 0 or step_s > 2 * MISSED * max(self.period_s, FASTEST_S):
            # The first step, two at once, or a long pause: begin anew.
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
        """Whether the next one's time is known."""
        return (
            self.n >= LEARNED
            and self.period_s >= FASTEST_S
            and self.jitter_s <= STEADY * self.period_s
        )

    def is_alive(self, now: float) -> bool:
        """Whether more messages of the topic are to be expected."""
        return now - self.seen_at <= MISSED * self.period_s

    @property
    def spread_s(self) -> float:
        """So long before or after its time a message may well come."""
        return self.jitter_s + AT_LEAST_S

    def is_late(self, now: float) -> bool:
        """Whether one has not come although it was due: it may come at any time."""
        over_s = now - self.beat_at - self.period_s
        return self.spread_s < over_s < self.period_s / 2

    def due(self, now: float) -> float:
        """When the next one should come; one that is late is waited for, for a while."""
        next_at = self.beat_at + self.period_s
        while next_at + self.spread_s < now:
            next_at += self.period_s
        return next_at


class Forecasts:
    """The periodic topics of this node, and of those whom it hears."""

    def __init__(self) -> None:
        self._by_key: dict[Hashable, Forecast] = {}
        self.most_urgent = Qos.BULK
        """Nothing that is followed is more urgent than this."""

    def note(self, key: Hashable, qos: Qos, at: float) -> None:
        """A message of that class was submitted, here or elsewhere, at `at` of our time."""
        if qos < self.most_urgent:
            self.most_urgent = qos
        found = self._by_key.get(key)
        if found is None:
            if len(self._by_key) >= MOST:
                # Whoever makes up robots shall not keep us busy.
                del self._by_key[min(self._by_key, key=lambda each: self._by_key[each].seen_at)]
            self._by_key[key] = Forecast(qos, at)
        elif at > found.seen_at:
            found.note(qos, at)

    def next_due(self, now: float, below: Qos) -> Forecast | None:
        """The topic more urgent than `below` that is due first; None when none is periodic."""
        first, first_at = None, inf
        for each in self._by_key.values():
            if each.qos < below and each.is_periodic and each.is_alive(now):
                at = each.due(now) - each.spread_s
                if at < first_at:
                    first, first_at = each, at
        return first

    def is_unforeseen(self, now: float, below: Qos, alive_s: float) -> bool:
        """Whether a topic more urgent than `below` is alive whose next message nobody knows."""
        return any(
            each.qos < below
            and now - each.seen_at < alive_s
            and (not each.is_periodic or each.is_late(now))
            for each in self._by_key.values()
        )
