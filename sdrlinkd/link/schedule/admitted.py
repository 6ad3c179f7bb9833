"""Which flows of a team get air: a rule that any robot can compute, and who computes it."""

from collections.abc import Iterable
from itertools import pairwise
from typing import NamedTuple

from sdrlinkd.link.paths import Edges, path, pdus_sent, tree
from sdrlinkd.link.qos import Qos
from sdrlinkd.wire import BROADCAST

FlowKey = tuple[int, int]
"""(robot, topic octet) of a flow."""


class Claim(NamedTuple):
    """A flow that wants `air`: its share of the airtime, over its whole route.

    `had_air`: it was admitted before.
    """

    key: FlowKey
    qos: int
    priority: int
    air: float
    had_air: bool = False


class Way(NamedTuple):
    """A PDU is sent `n_sent` times on average until it has arrived, and `relays` forward it."""

    n_sent: float
    relays: list[int]


def admitted(claims: Iterable[Claim], limit: float) -> set[FlowKey]:
    """The flows that get air, in shares of the airtime that sum up to `limit` at most.

    Higher classes come first, then higher priorities, then those that had air. So no flow is
    refused for the sake of one behind it. Urgent flows are always admitted.
    """
    found: set[FlowKey] = set()
    used = 0.0
    order = sorted(claims, key=lambda each: (each.qos, -each.priority, not each.had_air, each.key))
    for claim in order:
        if claim.qos == Qos.URGENT or used + claim.air <= limit:
            found.add(claim.key)
            used += claim.air
    return found


def planner_of(edges: Edges, own_id: int) -> int:
    """The robot that decides: of those with the fewest hops to the farthest one, the lowest id.

    That is the lowest id heard by all, where somebody is heard by all.
    """
    reached = set().union(*_rings(edges, own_id))
    return min(reached, key=lambda robot: (len(_rings(edges, robot)), robot))


def way_of(edges: Edges, src: int, dst: int) -> Way:
    """How PDUs from `src` come to `dst`, or to everyone.

    Nothing is saved by robots that are far enough apart to send at once.
    """
    if dst != BROADCAST:
        robots = path(edges, src, dst)
        n_sent = sum(pdus_sent(edges[one][other]) for one, other in pairwise(robots))
        return Way(max(1.0, n_sent), robots[1:-1])
    following = tree(edges, src)
    n_sent = sum(
        max((pdus_sent(edges[robot][each]) for each in next_ones), default=1.0)
        for robot, next_ones in following.items()
    )
    return Way(n_sent, sorted(following.keys() - {src}))


def _rings(edges: Edges, robot: int) -> list[set[int]]:
    """The robots by their hops from one of them, itself first."""
    found, seen = [{robot}], {robot}
    while ring := {other for each in found[-1] for other in edges.get(each, ())} - seen:
        seen |= ring
        found.append(ring)
    return found
