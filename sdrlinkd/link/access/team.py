"""The team as one robot knows it: who is here, who hears whom, and who hears plans from whom."""

from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from math import inf
from typing import NamedTuple

from sdrlinkd.link.access.reuse import NONE_APART, Apart
from sdrlinkd.link.paths import Edges, distances, fewest_hops
from sdrlinkd.wire import FAR

DOUBTFUL, DOUBTED_S = 4.0, 1.5
"""Cost of a link that was heard lately, and that LSAs do not tell; and for how long in s it counts,
as it is one that is new or that has ended."""
WEAK = 100.0
"""Cost of a link whose signal is so weak that most PDUs get lost, where LSAs do not tell."""
FRESH_S = 0.5
"""How often, in s, links are forgotten of which nothing was heard."""
SETTLED_S = 5.0
"""Time in s for which the same robots must have heard each other before two may send at once."""
PRESENT_S = 3.5
"""Time in s after which a robot that was not heard is gone: three periods of its beacon."""


class Places(NamedTuple):
    """Where robots are, as seen from the root: hops from there, and who passes plans on to them.

    Those that hear the root itself are not in `parents`.
    """

    levels: Mapping[int, int]
    parents: Mapping[int, int]
    costs: Mapping[int, float]
    """What the best path from the root costs."""
    fewest: Mapping[int, int]
    """The fewest hops over which plans come, if not always."""

    def order(self, node: int) -> tuple[int, int]:
        """The order of turns: by the fewest hops, then by those of the best path."""
        level = self.levels.get(node, 1)
        return self.fewest.get(node, level), level

    def is_behind(self, node: int, relay: int) -> bool:
        """Whether robot `node` hears plans through `relay`, directly or through others."""
        by = self.parents.get(node)
        while by is not None and by != relay:
            by = self.parents.get(by)
        return by == relay


class Team:
    """The robots `nodes`: presence, and links, which count as equally good both ways.

    LSAs tell links only where routes are found. So reports and our own receiver count, too.
    """

    def __init__(self, own_id: int, nodes: Sequence[int]) -> None:
        self.nodes = sorted(nodes)
        self._own_id = own_id
        self._seen_at: dict[int, float] = {}
        self._lsa_edges: Edges = {}
        self._link_at: dict[tuple[int, int], float] = {}
        self._weak: set[tuple[int, int]] = set()
        """Those with such a weak signal."""
        self._expired_at = 0.0
        self._places: dict[int, Places] = {}
        self._apart: Apart | None = None
        self._near: Mapping[int, Collection[int]] = {}
        self._near_since = inf
        """Since when the same robots hear each other, and who does."""

    def told_of(self, node: int, at: float, by: int, *, is_weak: bool = False) -> None:
        """Note that robot `by`, we or another one, hears robot `node`.

        If the signal is so weak that most PDUs get lost, that counts for little, and not where LSAs
        tell.
        """
        is_known = {node, by} <= self._lsa_edges.keys()
        if {node, by} <= set(self.nodes) and node != by and not (is_weak and is_known):
            self.seen(node, at)
            self._link(min(by, node), max(by, node), at, is_weak=is_weak)

    def seen(self, node: int, at: float) -> None:
        """Note that a robot of the team is here, wherever it is."""
        if node != self._own_id:
            self._seen_at[node] = at

    def learn(self, edges: Edges) -> None:
        """Take the links that LSAs tell."""
        self._lsa_edges = edges
        self._changed()

    def present(self, now: float) -> list[int]:
        """The other robots that are here, in ascending order: heard, told of, or reached."""
        since, own = now - PRESENT_S, self._own_id
        reached = self.places(own).costs if self._lsa_edges else {}
        return [
            node
            for node in self.nodes
            if node != own and (self._seen_at.get(node, -inf) > since or node in reached)
        ]

    def places(self, root: int) -> Places:
        """Where robots are from `root`: each hears plans on its best path."""
        found = self._places.get(root)
        if found is None:
            found = self._places[root] = places_of(root, self._edges())
        return found

    def apart(self, now: float) -> Apart:
        """Which robots may send at once at `now`.

        Where robots move, those that are three hops apart may soon be nearer; and they disturb each
        other's receivers from farther away than they are heard.
        """
        if self._apart is None:
            self._apart = Apart(self._edges())
        if self._apart.near != self._near:
            self._near, self._near_since = self._apart.near, now
        return self._apart if now > self._near_since + SETTLED_S else NONE_APART

    def reach(self, root: int, others: Collection[int]) -> int:
        """The cost of the path from `root` to the farthest of `others`; FAR if it is not known.

        That is the number of hops, and more where links lose PDUs.
        """
        costs = self.places(root).costs
        return min(FAR, max((round(costs.get(node, FAR)) for node in others), default=FAR))

    def _link(self, one: int, other: int, at: float, *, is_weak: bool) -> None:
        link = one, other
        if is_weak != (link in self._weak):
            self._weak ^= {link}
            self._changed()
        if link not in self._link_at or at > self._expired_at + FRESH_S:
            self._expired_at = at
            fresh = {each: told for each, told in self._link_at.items() if told > at - PRESENT_S}
            self._link_at = fresh
            self._changed()
        self._link_at[link] = at

    def _changed(self) -> None:
        self._places.clear()
        self._apart = None

    def _edges(self) -> Edges:
        known = {node: dict(links) for node, links in self._lsa_edges.items()}
        edges: defaultdict[int, dict[int, float]] = defaultdict(dict, known)
        for (one, other), at in self._link_at.items():
            cost = 1.0
            if one in known and other in known:
                # If they have LSAs that do not name each other, these know better.
                if at < self._expired_at - DOUBTED_S:
                    continue
                cost = DOUBTFUL
            elif (one, other) in self._weak:
                cost = WEAK
            edges[one].setdefault(other, cost)
            edges[other].setdefault(one, cost)
        return edges


def places_of(root: int, edges: Edges) -> Places:
    """Where robots are from `root`, over the best paths."""
    costs, parents = distances(edges, root)
    levels = {root: 0}

    def level(node: int) -> int:
        if node not in levels:
            levels[node] = 1 + level(parents[node])
        return levels[node]

    for node in parents:
        level(node)
    behind = {node: by for node, by in parents.items() if by != root}
    return Places(levels, behind, costs, fewest_hops(edges, root, WEAK))
