"""The topics of other robots that consumers here subscribe to, told in WANTED records."""

from collections.abc import Collection
from math import inf

from sdrlinkd.wire import Wanted

RENEW_S = 0.6
"""Time in s after which the wants are told again; a lease lasts five times as long."""
SHORTEST_S = 0.1
"""Shortest time in s between two records, for subscriptions that come and go."""


class Wants:
    """Times WANTED records: at once for what is new, and then as long as it is wanted.

    A record has room for `most` topics.
    """

    def __init__(self, most: int) -> None:
        self._most = max(1, most)
        self._wanted: frozenset[tuple[int, int]] = frozenset()
        self._told_at = -inf
        self._is_new = False

    def set(self, wanted: Collection[tuple[int, int]]) -> None:
        """Want exactly these topics, as (source, number), from now on."""
        new = frozenset(wanted)
        self._is_new = self._is_new or not new <= self._wanted
        self._wanted = new

    def due(self, now: float, present: Collection[int]) -> list[Wanted]:
        """The records to be told at `now`, to the robots that are `present`."""
        wait_s = SHORTEST_S if self._is_new else RENEW_S
        if not self._wanted or now < self._told_at + wait_s:
            return []
        self._told_at, self._is_new = now, False
        by_source: dict[int, list[int]] = {}
        for src, number in sorted(self._wanted):
            if src in present:
                by_source.setdefault(src, []).append(number)
        return [
            Wanted(src, bytes(numbers[i : i + self._most]))
            for src, numbers in by_source.items()
            for i in range(0, len(numbers), self._most)
        ]
