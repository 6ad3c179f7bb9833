"""Notices which robots always want to send something urgent, so that a person is told.

Such a robot is broken, or its topics have the wrong class.
"""

import math
from collections.abc import Collection
from math import inf

LONG_S = 10.0
"""Time in s for which a robot must want urgent all the time to be named."""
MOST, LESS = 0.9, 0.5
"""Share of the time from which on a robot is named, and below which it is no longer."""
MEMORY_S = LONG_S / math.log(1 / (1 - MOST))
"""Time in s in which what was is forgotten to 37 %: LONG_S without a break make MOST."""
LOOK_S = 0.1
"""Shortest time in s between two looks."""
STALE_S = 3.0
"""Time in s for which what was seen last counts."""


class AlwaysUrgent:
    """Which of `n` robots want urgent nearly all the time, and have more air for it than one in n.

    Air is counted in the unit of the policy.
    """

    def __init__(self, own_id: int, n: int) -> None:
        self._own_id = own_id
        self._n = n
        self._wanted: dict[int, float] = {}
        """Share of the time lately in which each robot wanted something urgent."""
        self._had: dict[int, float] = {}
        """The air that each robot had lately for that."""
        self._air = 0.0
        """All of the air lately."""
        self._named: set[int] = set()
        self._looked_at = -inf

    def passed(self, air: float) -> None:
        """Note that some air has passed, whoever had it."""
        self._air += air

    def had(self, node: int, air: float) -> None:
        """Note that a robot had some of it for something urgent."""
        self._had[node] = self._had.get(node, 0.0) + air

    def has_more(self, node: int) -> bool:
        """Whether a robot had more than one in n of the air lately, for something urgent."""
        return self._had.get(node, 0.0) * self._n > self._air

    def look(self, wanting: Collection[int], now: float) -> None:
        """Note who wants something urgent at `now`."""
        since_s = now - self._looked_at
        if since_s < LOOK_S:
            return
        self._looked_at = now
        kept, is_known = math.exp(-since_s / MEMORY_S), since_s < STALE_S
        self._air *= kept
        self._had = {node: kept * air for node, air in self._had.items()}
        for node in {*self._wanted, *wanting}:
            wants = is_known and node in wanting
            share = kept * self._wanted.get(node, 0.0) + (1 - kept) * wants
            self._wanted[node] = share
            if share >= MOST and self.has_more(node):
                self._named.add(node)
            elif share < LESS:
                self._named.discard(node)

    def notices(self, now: float) -> list[str]:
        """Sentences on robots that always want urgent."""
        if now > self._looked_at + STALE_S:
            return []
        return [
            f"{'this robot' if node == self._own_id else f'robot {node}'} has wanted urgent for "
            f"{LONG_S:g} s almost without a break: check which of its topics have "
            'qos = "urgent", and how often they send'
            for node in sorted(self._named)
        ]
