"""Who forwards next what this robot sends and forwards, and whom it goes around."""

from collections.abc import Iterator
from typing import NamedTuple

from sdrlinkd.link.paths import Edges, distances, path, tree
from sdrlinkd.link.routes.flow import UNANSWERED, Flow
from sdrlinkd.link.routes.links import Links
from sdrlinkd.link.routes.named import Ends, Named
from sdrlinkd.reports import FlowReport
from sdrlinkd.wire import BROADCAST, PDU_NUMBERS, Need, Route

RENEWED_S, DOUBTED_S = 1.0, 0.15
"""Times in s after which a ROUTE is told again: usually, and where somebody may not know it."""
AROUND_S, LEAST_AROUND_S = 5.0, 1.0
"""Time in s for which a robot that did not answer is gone around; the least if it does answer."""
STAYS = 0.8
"""A path is left for one that costs less than this part of it."""
AVOIDED = 100.0
"""How many times more a link costs to a robot that did not answer, or that has the PDUs already: as
if a third of them arrived each way. So a path of good links goes around it, and none of bad ones.
"""


class Again(NamedTuple):
    """PDUs of `src` that robot `hop` has not answered, and that are sent again."""

    hop: int
    src: int
    numbers: list[int]


class Forwarding:
    """Names those who forward next, flow by flow, and changes them if they do not answer."""

    def __init__(self, own_id: int, links: Links, named: Named) -> None:
        self._own_id = own_id
        self._links = links
        self._named = named
        self._flows: dict[Ends, Flow] = {}
        self._version = -1
        self.around: dict[int, float] = {}
        """The robots that did not answer, and since when they are gone around."""
        self.has_news = False
        """Whether `take_news` would return something."""
        self.begin_anew()

    def sent(
        self, src: int, dst: int, number: int, hops_left: int, at: float, *, is_bare: bool = False
    ) -> None:
        """Note that a PDU has left at `at`; again, if it was repeated.

        `is_bare`: it holds only control records, and nobody answers for it.
        """
        flow = self._flows.get((src, dst))
        if flow is None:
            # Its hops come before its first PDU, for which they have to answer, too.
            flow = self._flows[src, dst] = Flow(src, dst, number)
            self._reroute(flow, at)
        flow.sent(number, hops_left, at, is_bare=is_bare)

    def forwarded(self, src: int, dst: int, seq: int, hops_left: int, at: float) -> None:
        """Note that a PDU came from another robot than its source."""
        flow = self._flows.get((src, dst))
        if flow is not None:
            flow.heard(seq, hops_left, at)

    def comes_late(self, src: int, dst: int, hops_left: int) -> bool:
        """Whether a copy may be from a robot that names us, sent after we had forwarded the PDU.

        Ours had as many hops left, or more, so it was no answer to that robot.
        """
        flow = self._flows.get((src, dst))
        return flow is not None and dst != BROADCAST and hops_left >= flow.hops_left

    def answered(self, hop: int, need: Need, at: float) -> None:
        """Take a NEED: its sender has heard of all PDUs before the last one that it names."""
        up_to = (max(need.numbers(), default=need.number - 1) + 1) % PDU_NUMBERS
        for flow in self._flows.values():
            if flow.src == need.node:
                # It answers for all PDUs of this source. For those to one robot, whether it knows
                # that it is named shows when it forwards them.
                is_named = flow.dst == BROADCAST and not any(need.bitmap)
                flow.answered(hop, up_to, at, is_named=is_named)
        if at - self.around.get(hop, at) > LEAST_AROUND_S:
            del self.around[hop]
            self._version = -1

    def look(self, now: float) -> list[Again]:
        """Find paths if the links have changed; returns what is sent again, as nobody answered."""
        for hop in [hop for hop, since in self.around.items() if now - since > AROUND_S]:
            del self.around[hop]
            self._version = -1
        again = list(self._unanswered(now))
        is_new, self._version = self._version != self._links.version, self._links.version
        for ends, flow in self._flows.items():
            if is_new or flow.tellers != self._named.tellers(ends):
                self._reroute(flow, now)
        for ends, flow in list(self._flows.items()):
            if not flow.is_active(now) and ends != (self._own_id, BROADCAST):
                del self._flows[ends]
            elif flow.robots and now - flow.told_at > RENEWED_S:
                self.has_news = True
            elif flow.is_doubtful and now - flow.told_at > DOUBTED_S:
                flow.doubts += 1
                flow.is_news = self.has_news = True
        return again

    def take_news(self, now: float) -> Iterator[tuple[Route, float]]:
        """(ROUTE, when it gets a PDU of its own) of those to be told."""
        for flow in self._flows.values():
            if flow.is_news or (flow.robots and now - flow.told_at > RENEWED_S):
                alone_at = now if flow.is_news else now + RENEWED_S
                flow.told_at, flow.is_news = now, False
                robots = bytes(sorted(flow.robots))
                yield Route(flow.src, flow.dst, flow.first % PDU_NUMBERS, robots), alone_at
        self.has_news = False

    def begin_anew(self) -> None:
        """Go on with another clock."""
        self._flows.clear()
        self.around.clear()
        self.has_news = False
        # There is always something for everyone, such as declarations.
        self._flows[self._own_id, BROADCAST] = Flow(self._own_id, BROADCAST, 0)

    def report(self, now: float) -> list[FlowReport]:
        """Who forwards what next, as far as somebody does."""
        return [
            FlowReport(
                src=src, dst=dst, forwarded_by=sorted(flow.robots), went_around=flow.went_around
            )
            for (src, dst), flow in sorted(self._flows.items())
            if flow.is_active(now) or flow.robots
        ]

    def _edges(self, flow: Flow) -> Edges:
        """The links of the team as a flow sees them: those to be avoided cost more.

        The source never gets its PDUs back. Robots that name us for them have them already.
        """
        edges, own, around = self._links.edges, self._own_id, self.around
        is_relayed = flow.dst != BROADCAST and flow.src != own
        if not (around or is_relayed):
            return edges
        src, had = (flow.src, flow.tellers) if is_relayed else (None, ())

        def seen(one: int, other: int, cost: float) -> float:
            is_avoided = other in had or (one == own and other in around)
            return cost * AVOIDED if is_avoided else cost

        return {
            one: {other: seen(one, other, cost) for other, cost in links.items() if other != src}
            for one, links in edges.items()
        }

    def _reroute(self, flow: Flow, now: float) -> None:
        """Find out who forwards a flow next."""
        flow.tellers = self._named.tellers((flow.src, flow.dst))
        edges = self._edges(flow)
        if flow.dst == BROADCAST:
            robots = hops = tree(edges, flow.src).get(self._own_id, frozenset())
        else:
            found = self._path(flow, edges)
            hops = frozenset(found[1:2])
            robots = hops if len(found) > 2 else frozenset()
        self.has_news |= flow.name(robots, hops, now)

    def _path(self, flow: Flow, edges: Edges) -> list[int]:
        """The path of a flow from here; the present one stays unless another is clearly better."""
        own, dst = self._own_id, flow.dst
        best = path(edges, own, dst)
        for hop in flow.hops - set(best):
            rest = path(edges, hop, dst)
            if hop in edges.get(own, {}) and rest and own not in rest:
                cost, onward = distances(edges, own)[0], distances(edges, hop)[0]
                if STAYS * (edges[own][hop] + onward[dst]) <= cost[dst]:
                    return [own, *rest]
        return best

    def _unanswered(self, now: float) -> Iterator[Again]:
        for flow in self._flows.values():
            for hop in sorted(flow.hops):
                numbers, times = flow.unanswered(hop, now)
                if times >= UNANSWERED:
                    self._go_around(flow, hop, now)
                elif numbers:
                    yield Again(hop, flow.src, [number % PDU_NUMBERS for number in numbers])

    def _go_around(self, flow: Flow, hop: int, now: float) -> None:
        first, before = flow.first_unanswered(hop), flow.robots
        self.around[hop] = now
        self._version = -1
        self._reroute(flow, now)
        # If there is no other path, it goes on with what comes next.
        flow.forgive(hop)
        if flow.robots != before:
            flow.went_around += 1
            flow.first = flow.first if first is None else first
