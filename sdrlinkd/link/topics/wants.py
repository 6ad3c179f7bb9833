"""The topics of other robots that consumers here subscribe to, told in WANTED records."""

from collections.abc import Collection, Mapping
from math import inf
from types import MappingProxyType

from sdrlinkd.wire import RatesAsked, Wanted, period_code

RENEW_S = 0.6
"""Time in s after which the wants are told again; a lease lasts five times as long."""
SHORTEST_S = 0.1
"""Shortest time in s between two records, for subscriptions that come and go."""
NOTHING: Mapping[tuple[int, int], float] = MappingProxyType({})


class Wants:
    """Times WANTED records: at once for what is new, and then as long as it is wanted.

    A record has room for `most` topics.
    """

    def __init__(self, most: int) -> None:
        self._most = max(1, most)
        self._wanted: frozenset[tuple[int, int]] = frozenset()
        self._codes: Mapping[tuple[int, int], int] = {}
        self._told_at = -inf
        self._is_new = False

    def set(
        self,
        wanted: Collection[tuple[int, int]],
        periods_s: Mapping[tuple[int, int], float] = NOTHING,
    ) -> None:
        """Want exactly these topics, as (source, number), from now on.

        Of those in `periods_s`, a message in each period of so many s is enough.
        """
        new = frozenset(wanted)
        codes = {key: period_code(period) for key, period in periods_s.items() if key in new}
        self._is_new = self._is_new or not new <= self._wanted or codes != self._codes
        self._wanted, self._codes = new, codes

    def due(self, now: float, present: Collection[int]) -> list[Wanted | RatesAsked]:
        """The records to be told at `now`, to the robots that are `present`."""
        wait_s = SHORTEST_S if self._is_new else RENEW_S
        if not self._wanted or now < self._told_at + wait_s:
            return []
        self._told_at, self._is_new = now, False
        by_source: dict[int, list[int]] = {}
        for src, number in sorted(self._wanted):
            if src in present:
                by_source.setdefault(src, []).append(number)
        records: list[Wanted | RatesAsked] = []
        for src, numbers in by_source.items():
            records += [
                Wanted(src, bytes(numbers[i : i + self._most]))
                for i in range(0, len(numbers), self._most)
            ]
            codes = [(n, self._codes[src, n]) for n in numbers if (src, n) in self._codes]
            most = max(1, self._most // 2)
            records += [
                RatesAsked(src, tuple(codes[i : i + most])) for i in range(0, len(codes), most)
            ]
        return records
