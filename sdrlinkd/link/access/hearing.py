"""Whether all robots of the team that are here hear each other, as LSAs tell it."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from math import inf

from sdrlinkd.link.access.team import DOUBTFUL, PRESENT_S
from sdrlinkd.link.paths import Edges
from sdrlinkd.link.pauses import usual_gap

DEAF_S, POOR_S = 2.5, 5.0
"""Time in s for which two robots must have been here, and have told nothing of each other, or that
they hear each other poorly, before they count as apart. In the first one, a pause that is not
noticed (below) has room, and after it a lost LSA that comes again. After a pause, what came
meanwhile counts as lost for some time."""
DEAF_COST = 1e4
"""Cost of a link on which next to nothing arrives."""
UNHEARD_S = PRESENT_S
"""Time in s for which others must have told of a robot that we do not hear, if LSAs do not tell."""
GONE_GAPS, LEAST_GONE_S, MOST_GONE_S = 2.2, 0.8, 2.2
"""A robot of which nothing was heard for so many of its usual gaps, within these limits in s, was
away, and begins anew. So does this one if it has heard nobody."""
FIRST_GAP_S = 1.0

Pair = tuple[int, int]


@dataclass(slots=True)
class _Sight:
    """When a robot was seen last, by anybody; since when it is here, and its longest usual gap."""

    at: float
    came_at: float
    gap_s: float = FIRST_GAP_S

    def again(self, at: float) -> None:
        gap_s = at - self.at
        if gap_s > min(max(GONE_GAPS * self.gap_s, LEAST_GONE_S), MOST_GONE_S):
            self.came_at = at
        else:
            self.gap_s = usual_gap(gap_s, self.gap_s)
        self.at = max(at, self.at)


Sights = dict[int, _Sight]


class Hearing:
    """Finds two of the robots `nodes` that do not hear each other."""

    def __init__(self, own_id: int, nodes: Sequence[int]) -> None:
        self._own_id = own_id
        self._nodes = frozenset(nodes)
        self._seen: Sights = {}
        """When we or somebody else heard each robot; for this one, when it heard anybody."""
        self._heard: Sights = {}
        """When we did. Others may tell of a robot for some time after it has gone."""
        self._edges: Edges = {}
        self._poor_since: dict[Pair, float] = {}
        """Since when LSAs tell of two robots that they do not hear each other well."""
        self._deaf_since: dict[Pair, float] = {}
        """Since when they tell that these do not hear each other at all."""
        self.is_sure = True
        """Whether all hear all well, by the last look."""

    def heard(self, node: int, at: float) -> None:
        """Note that we hear a robot."""
        for seen in (self._seen, self._heard):
            self._see(seen, self._own_id, at)
            self._see(seen, node, at)

    def told_of(self, node: int, at: float, by: int) -> None:
        """Note that robot `by` says that it hears a robot; what its LSA denies, was long ago."""
        links = self._edges.get(by)
        if node != self._own_id and (not links or node in links):
            self._see(self._seen, node, at)

    def learn(self, edges: Edges) -> None:
        """Take the links that LSAs tell."""
        self._edges = edges

    def apart(self, now: float) -> Pair | None:
        """Two robots that are here and do not hear each other; None: all hear all.

        Of others, they are two that this one hears: where a team is connected and not all hear all,
        some robot hears two that do not hear each other.
        """
        here = {node for node, seen in self._seen.items() if seen.at > now - PRESENT_S}
        found, poor, deaf = None, dict[Pair, float](), dict[Pair, float]()
        for pair in combinations(sorted({self._own_id, *here}), 2):
            cost = self._cost(pair)
            if cost is None:
                if self._is_unheard(pair):
                    found = found or pair
                continue
            if cost <= DOUBTFUL:
                continue
            poor[pair] = self._poor_since.get(pair, now)
            is_apart = self._were_here(self._heard, pair, poor[pair], POOR_S)
            if cost >= DEAF_COST:
                deaf[pair] = self._deaf_since.get(pair, now)
                is_apart |= self._were_here(self._heard, pair, deaf[pair], DEAF_S)
            if is_apart and found is None:
                found = pair
        self._poor_since, self._deaf_since = poor, deaf
        self.is_sure = not poor and found is None
        return found

    def _cost(self, pair: Pair) -> float | None:
        """What a link costs; infinity: there is none. None: a robot tells of no links yet."""
        one, other = pair
        links = self._edges.get(one)
        return links.get(other, inf) if links and self._edges.get(other) else None

    def _is_unheard(self, pair: Pair) -> bool:
        """Whether we are one of two robots, and do not hear the other one."""
        if self._own_id not in pair:
            return False
        (other,) = {*pair} - {self._own_id}
        since = self._heard[other].at if other in self._heard else -inf
        return self._were_here(self._seen, pair, since, UNHEARD_S)

    def _were_here(self, seen: Sights, pair: Pair, since: float, for_s: float) -> bool:
        """Whether two robots, and this one, were here for so long after `since`, by `seen`."""
        nodes = {*pair, self._own_id}
        if not nodes <= seen.keys():
            return False
        since = max(since, *(seen[node].came_at for node in nodes))
        return min(seen[node].at for node in nodes) > since + for_s

    def _see(self, seen: Sights, node: int, at: float) -> None:
        sight = seen.get(node)
        if sight is not None:
            sight.again(at)
        elif node in self._nodes:
            seen[node] = _Sight(at, at)
