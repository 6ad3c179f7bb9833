"""The LSAs of the team, and the links that follow from them."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf

from sdrlinkd.link.paths import Edges, cost_of, distances
from sdrlinkd.wire import BROADCAST, LSA_NUMBERS, MAX_LOSS, Lsa, lsa_digest, share_of

MOST_ROBOTS = 32
"""Most robots of which LSAs are held."""
FORGOTTEN_S = 10.0
"""Time in s for which the LSA of a robot that cannot be reached is held."""
LEAST_NEWS_S, LEAST_CHANGE_S = 0.1, 0.5
"""Least times in s between two LSAs of ours: if other robots are heard, and if losses changed."""


@dataclass(slots=True)
class _Held:
    lsa: Lsa
    losses: Mapping[int, int]
    """Those of `lsa`, by robot."""
    at: float
    """When it came."""
    reached_at: float
    is_restarted: bool = False
    """Whether any number counts as newer, as the robot has restarted."""


class LsaTable:
    """The newest LSA of each robot, ours among them; our first one has the number `first`."""

    def __init__(self, own_id: int, first: int) -> None:
        self._own_id = own_id
        self._held: dict[int, _Held] = {}
        self.number_from(first)
        self.renewed_at = -inf
        """When our own LSA was made."""
        self._is_overtaken = False
        """Whether others hold an LSA of ours that is newer than ours."""
        self.edges: Edges = {}
        """The links that both ends hear."""
        self.version = 0
        """Counts the changes of `edges`."""
        self.reached: list[int] = []
        """This robot, and those to which a path leads."""

    def number_from(self, first: int) -> None:
        """Give our next LSA the number after `first`."""
        self._number = first % LSA_NUMBERS

    def __contains__(self, node: int) -> bool:
        return node in self._held

    def held(self) -> list[tuple[Lsa, float]]:
        """(LSA, when it came) of each robot."""
        return sorted((each.lsa, each.at) for each in self._held.values())

    def lsa(self, node: int) -> Lsa | None:
        """The LSA of a robot; None if it is not held (any more)."""
        held = self._held.get(node)
        return None if held is None else held.lsa

    def digest(self) -> Lsa:
        """The record that stands for the LSAs of all robots that are reached."""
        return lsa_digest({node: self._held[node].lsa.number for node in self.reached})

    def heard_by(self, node: int) -> list[int]:
        """The robots that one is known to hear."""
        held = self._held.get(node)
        return [] if held is None else [robot for robot, _ in held.lsa.losses]

    def renew(self, losses: Mapping[int, int], room: int, now: float) -> Lsa | None:
        """Our new LSA of at most `room` robots, if `losses` are news; else None."""
        best = sorted(losses.items(), key=lambda each: (each[1], each[0]))[:room]
        told = tuple(sorted(best))
        held = self._held.get(self._own_id)
        if held is None and not told:
            # Nobody is there to be told.
            return None
        if held is not None and not self._is_overtaken:
            if told == held.lsa.losses:
                return None
            is_news = {node for node, _ in told} != {node for node, _ in held.lsa.losses}
            if now - self.renewed_at < (LEAST_NEWS_S if is_news else LEAST_CHANGE_S):
                return None
        self._number = (self._number + 1) % LSA_NUMBERS
        self.renewed_at, self._is_overtaken = now, False
        lsa = Lsa(self._own_id, self._number, told)
        self._hold(lsa, now)
        return lsa

    def take(self, lsa: Lsa, teller: int, at: float) -> bool:
        """Take an LSA that robot `teller` told; returns whether it is newer than ours of it."""
        node = lsa.node
        if node == BROADCAST:
            return False
        if node == self._own_id:
            # It is of an earlier life of ours, or nobody's.
            if lsa.is_newer(self._number):
                self._number, self._is_overtaken = lsa.number, True
            return False
        held = self._held.get(node)
        if held is None and len(self._held) >= MOST_ROBOTS:
            return False
        if held is not None and not lsa.is_newer(held.lsa.number):
            is_other = lsa.number == held.lsa.number and lsa.losses != held.lsa.losses
            if teller != node or not (is_other or held.is_restarted):
                return False
            if lsa == held.lsa:
                held.is_restarted = False
                return False
        self._hold(lsa, at)
        return True

    def restarted(self, node: int) -> None:
        """Take the next LSA that a robot tells itself for newer, whatever its number."""
        held = self._held.get(node)
        if held is not None:
            held.is_restarted = True

    def expire(self, now: float) -> None:
        """Forget the robots that could not be reached for long."""
        for node, held in list(self._held.items()):
            if node in self.reached:
                held.reached_at = now
            elif now - held.reached_at > FORGOTTEN_S:
                del self._held[node]
                self._change(node)

    def begin_anew(self) -> None:
        """Go on with another clock: only what comes from now on counts."""
        self._held.clear()
        self.edges = {}
        self.renewed_at = -inf
        self._change(self._own_id)

    def _hold(self, lsa: Lsa, at: float) -> None:
        losses = {robot: loss for robot, loss in lsa.losses if robot != lsa.node}
        before = self._held.get(lsa.node)
        reached_at = at if before is None else before.reached_at
        lsa = lsa._replace(losses=tuple(losses.items()))
        self._held[lsa.node] = _Held(lsa, losses, at, reached_at)
        self._change(lsa.node)

    def _change(self, node: int) -> None:
        """Find the links of a robot whose LSA has changed, and who is reached.

        Others keep what they were given as the links before.
        """
        links = self._links_of(node)
        edges = {
            other: _with(those, node, links.get(other))
            for other, those in self.edges.items()
            if other != node
        }
        if node in self._held:
            edges[node] = links
        self.edges = edges
        reached, _ = distances(edges, self._own_id)
        self.reached = sorted(node for node in reached if node in self._held)
        self.version += 1

    def _links_of(self, node: int) -> dict[int, float]:
        """What the links of a robot cost, by the robot at the other end: the same both ways."""
        held, links = self._held.get(node), dict[int, float]()
        for other, loss in () if held is None else held.losses.items():
            there = self._held.get(other)
            back = MAX_LOSS if there is None else there.losses.get(node, MAX_LOSS)
            if loss < MAX_LOSS and back < MAX_LOSS:
                # Their sum, as losses are logarithms: which way loses more must not matter, not
                # even in the last digit.
                links[other] = cost_of(share_of(loss + back))
        return links


def _with(links: Mapping[int, float], node: int, cost: float | None) -> Mapping[int, float]:
    """The links of a robot, with one to `node` of this cost; None: with none."""
    if links.get(node) == cost:
        return links
    changed = {other: each for other, each in links.items() if other != node}
    return changed if cost is None else {**changed, node: cost}
