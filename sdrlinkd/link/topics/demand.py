"""The topics of this robot that consumers at other robots subscribe to, by their WANTED records."""

from collections.abc import Collection
from math import inf

from sdrlinkd.link.topics.own import OwnTopics
from sdrlinkd.wire import RatesAsked, Wanted, period_s

LEASE_S = 3.0
"""Time in s for which a WANTED record holds."""
MOST_PERIOD_S = 60.0
"""Longest period that is granted, whatever is asked for."""


class Demand:
    """Leases of declared topics. A robot that falls silent wants nothing any more."""

    def __init__(self, topics: OwnTopics) -> None:
        self._topics = topics
        self._until: dict[tuple[str, int], float] = {}
        """When the lease of a topic by a robot ends."""
        self._periods: dict[tuple[str, int], tuple[float, float]] = {}
        """The period that suffices a robot for a topic, and when its lease ends."""
        self._own: tuple[int, frozenset[int]] = (0, frozenset())
        self._least: dict[str, float] = {}
        self._look_at = inf
        """When `_least` may change: a lease ends, or something was heard."""

    def want_own(self, own_id: int, numbers: Collection[int]) -> None:
        """Note what consumers here want of this robot itself, which hears its own PDUs."""
        self._own = own_id, frozenset(numbers)
        self._look_at = -inf

    def hear(self, src: int, wanted: Wanted, at: float) -> None:
        """Take what robot `src` wants of this robot. Numbers that nobody declared are ignored."""
        for number in wanted.topics:
            about = self._topics.told.get(number)
            if about is not None:
                self._until[about.name, src] = at + LEASE_S
        self._look_at = -inf

    def hear_rates(self, src: int, asked: RatesAsked, at: float) -> None:
        """Take how often messages of topics of this robot suffice robot `src`."""
        for number, code in asked.periods:
            about = self._topics.told.get(number)
            if about is not None:
                period = min(period_s(code), MOST_PERIOD_S)
                self._periods[about.name, src] = period, at + LEASE_S
        self._look_at = -inf

    def periods(self, now: float) -> dict[str, float]:
        """The period in s that suffices all who want a topic at `now`, by name.

        Topics are missing of which somebody wants every message.
        """
        if not (self._periods or self._least) or now < self._look_at:
            return self._least
        self._periods = {key: told for key, told in self._periods.items() if told[1] > now}
        found: dict[str, float] = {}
        for name, robots in self.wanted(now).items():
            least = min(self._periods.get((name, src), (0.0, 0.0))[0] for src in robots)
            if least:
                found[name] = least
        self._least = found
        ends = [*self._until.values(), *(until for _, until in self._periods.values())]
        self._look_at = min(ends, default=inf)
        return found

    def wanted(self, now: float) -> dict[str, list[int]]:
        """The names of the topics that are wanted at `now`, and the robots that want each."""
        self._until = {key: until for key, until in self._until.items() if until > now}
        own_id, numbers = self._own
        own = {(self._topics.told[n].name, own_id) for n in numbers if n in self._topics.told}
        found: dict[str, list[int]] = {}
        for name, src in sorted(self._until.keys() | own):
            found.setdefault(name, []).append(src)
        return found
