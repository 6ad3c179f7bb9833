"""The best paths through a team, and who forwards what is for everyone."""

from collections import defaultdict
from collections.abc import Mapping
from heapq import heappop, heappush
from math import inf

Edges = Mapping[int, Mapping[int, float]]
"""What a link from one robot to another costs, `edges[a][b]`: 1 if it loses nothing."""
LOSSY = 2.0
"""Exponent of the expected number of tries, until a PDU and its answer arrive, in the cost of a
link: two hops that lose nothing are better than one that loses a sixth each way, as repeats take
time, and may be lost, too."""
HALF_BELOW_DB = 1.0
"""How far below the SNR that is needed half of the PDUs are lost at least."""
MOST_COST = 1e6
"""What a link costs at most. Beside much larger numbers, a link that costs 1 would cost nothing."""
NEAR = 1.1
"""How much longer than the best path one may be that takes fewer relays."""


def cost_of(share: float) -> float:
    """What a link costs over which this share of PDUs, and of the answers to them, arrives."""
    return float(min(share**-LOSSY, MOST_COST))


def pdus_sent(cost: float) -> float:
    """How many PDUs are sent over a link of this cost until one arrives, the same both ways."""
    return float(cost ** (0.5 / LOSSY))


def distances(edges: Edges, source: int) -> tuple[dict[int, float], dict[int, int]]:
    """(cost from `source`, the robot before it on the best path) of all robots that are reached.

    Dijkstra's algorithm. Among equals, the lower id comes first, so that all robots agree.
    """
    found: dict[int, float] = {}
    before: dict[int, int] = {}
    heap = [(0.0, source, source)]
    while heap:
        cost, robot, last = heappop(heap)
        if robot in found:
            continue
        found[robot] = cost
        if robot != source:
            before[robot] = last
        for other, more in edges.get(robot, {}).items():
            if other not in found:
                heappush(heap, (cost + more, other, robot))
    return found, before


def fewest_hops(edges: Edges, source: int, most_cost: float) -> dict[int, int]:
    """How many links that cost less than `most_cost` lead from `source` to each robot, at least."""
    found, newest, hops = {source: 0}, {source}, 0
    while newest:
        hops += 1
        reached = (edges.get(each, {}).items() for each in newest)
        newest = {other for links in reached for other, cost in links if cost < most_cost}
        newest -= found.keys()
        found |= dict.fromkeys(newest, hops)
    return found


def path(edges: Edges, source: int, to: int) -> list[int]:
    """The robots on the best path, with both ends; empty if there is none."""
    _, before = distances(edges, source)
    if to != source and to not in before:
        return []
    found = [to]
    while found[-1] != source:
        found.append(before[found[-1]])
    return found[::-1]


def tree(edges: Edges, source: int) -> dict[int, frozenset[int]]:
    """For each robot that sends or forwards what `source` sends to everyone: who forwards it next.

    Every robot is reached over a path that is nearly the best. Among these, few robots forward.
    """
    cost, _ = distances(edges, source)
    forwards = {source}
    parents: dict[int, int] = {}
    left = sorted((each for each in cost if each != source), key=lambda each: (cost[each], each))
    while left:
        near = {each: _parents(edges, cost, each) for each in left}
        waiting = []
        for each in left:
            known = [parent for parent in near[each] if parent in forwards]
            if known:
                parents[each] = min(known, key=lambda parent: (cost[parent], parent))
            else:
                waiting.append(each)
        if waiting:
            forwards.add(_most_useful(near, waiting, cost, parents))
        left = waiting
    following: defaultdict[int, set[int]] = defaultdict(set)
    for each in forwards - {source}:
        following[parents[each]].add(each)
    return {each: frozenset(following[each]) for each in forwards}


def _parents(edges: Edges, cost: Mapping[int, float], robot: int) -> set[int]:
    """Those from which a robot can have a PDU over a path that is nearly the best."""
    most = NEAR * cost[robot]
    return {
        each
        for each, at in cost.items()
        if at < cost[robot] and at + edges.get(each, {}).get(robot, inf) <= most
    }


def _most_useful(
    near: Mapping[int, set[int]], waiting: list[int], cost: Mapping[int, float],
    reached: Mapping[int, int],
) -> int:  # fmt: skip
    """The robot, of those that are reached, from which most of the others can have a PDU."""
    useful: dict[int, int] = defaultdict(int)
    for each in waiting:
        for parent in near[each]:
            if parent in reached:
                useful[parent] += 1
    return min(useful, key=lambda robot: (-useful[robot], cost[robot], robot))
