"""The most reliable path through the link quality matrix."""

from collections.abc import Collection
from heapq import heappop, heappush
from math import inf, log

from benchmarks.peers.pound.rtwmp.lqm import Lqm


def next_hop(lqm: Lqm, src: int, dst: int, without: Collection[int] = ()) -> int | None:
    """The node after `src` on the path to `dst` that loses least, by Dijkstra's algorithm.

    A link costs -log p, p its quality as a probability. The path avoids the nodes `without`.
    Returns None if there is no path.
    """
    n_nodes = len(lqm.rows)
    cost = [inf] * n_nodes
    cost[src] = 0.0
    first: list[int | None] = [None] * n_nodes
    heap = [(0.0, src)]
    while heap:
        so_far, node = heappop(heap)
        if node == dst:
            return first[dst]
        if so_far > cost[node]:
            continue
        for other in range(n_nodes):
            quality = lqm.link(node, other) if other != node else 0.0
            if not quality or other in without:
                continue
            # A perfect link costs a little, too: of equal paths, the shortest.
            total = so_far + 1e-6 - log(min(quality, 100.0) / 100.0)
            if total < cost[other]:
                cost[other] = total
                first[other] = other if node == src else first[node]
                heappush(heap, (total, other))
    return None
