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


def transmissions(edges: Edges, src: int, dst: int) -> float:
    """How often a PDU from `src` is sent on average until it is at `dst`, or at everyone.

    Nothing is saved by robots that are far enough apart to send at once.
    """
    if dst != BROADCAST:
        hops = pairwise(path(edges, src, dst))
        return max(1.0, sum(pdus_sent(edges[one][other]) for one, other in hops))
    return sum(
        max((pdus_sent(edges[robot][each]) for each in following), default=1.0)
        for robot, following in tree(edges, src).items()
    )


def relays_of(edges: Edges, src: int, dst: int) -> list[int]:
    """The robots that forward what `src` sends to `dst`, or to everyone."""
    if dst != BROADCAST:
        return path(edges, src, dst)[1:-1]
    return sorted(robot for robot in tree(edges, src) if robot != src)


def _rings(edges: Edges, robot: int) -> list[set[int]]:
    """The robots by their hops from one of them, itself first."""
    found, seen = [{robot}], {robot}
    while ring := {other for each in found[-1] for other in edges.get(each, ())} - seen:
        seen |= ring
        found.append(ring)
    return found
