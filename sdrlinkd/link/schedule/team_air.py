"""Air that flows reserve in a team: who asks for it, and which flows the planner admits."""

from collections.abc import Callable, Sequence
from math import inf
from typing import NamedTuple

from sdrlinkd.link.paths import Edges
from sdrlinkd.link.qos import Qos
from sdrlinkd.link.schedule.admitted import Claim, Way, admitted, planner_of, way_of
from sdrlinkd.link.schedule.flow_table import FlowTable, is_sound
from sdrlinkd.link.schedule.params import AdmissionParams
from sdrlinkd.link.schedule.retelling import RecordKey, Retelling
from sdrlinkd.link.schedule.verdicts import Verdicts, is_sound_word
from sdrlinkd.wire import (
    FLOW_AIR_UNIT,
    FLOW_SIZE,
    FLOWS_NUMBERS,
    FLOWS_OVERHEAD,
    MOST_FLOWS,
    Admit,
    Flows,
    RecordType,
    ReservedFlow,
    is_newer_number,
)

CONTROL_SHARE = 0.02
"""Share of the airtime that is kept for the records of links, routes and flows."""
LOOK_S, RENEWED_S = 0.1, 5.0
"""Times in s between two looks at the flows, and until records are told anew."""
CHANGED = 0.125
"""Relative change of a flow's air that is told."""
STEADY = 0.25
"""Relative change of a route's cost that is still taken for noise."""


class TeamFlow(NamedTuple):
    """A flow of robot `src`; `air` is its share of the airtime over its route, through `via`.

    `is_admitted` None: the planner has not said anything of it yet.
    """

    src: int
    flow: ReservedFlow
    air: float
    via: list[int]
    is_admitted: bool | None


class ToldOfAir(NamedTuple):
    """A record to be sent in spare room, and from `alone_at` on in a PDU of its own."""

    record: Flows | Admit
    key: RecordKey
    alone_at: float


class TeamAir:
    """Tells our flows, and holds those of the team; as the planner, decides who gets air.

    `room` is the number of record octets in a PDU. `draw` gives the first numbers of our records.
    `relays`: records of others are told on.
    """

    def __init__(
        self, params: AdmissionParams, own_id: int, room: int, draw: Callable[[], int], *,
        relays: bool,
    ) -> None:  # fmt: skip
        self._own_id, self._relays, self._draw = own_id, relays, draw
        self._share = params.share
        self._most = min(MOST_FLOWS, max(0, room - FLOWS_OVERHEAD) // FLOW_SIZE)
        self.is_on = params.share > 0 and self._most > 0
        """Whether flows reserve air."""
        self.ignored = 0
        """Records that cannot be true, or that are not from the planner."""
        self._table = FlowTable()
        self._verdicts: Verdicts | None = None
        self._number: int | None = None
        self._own: tuple[ReservedFlow, ...] = ()
        self._topics: frozenset[int] = frozenset()
        self._edges: Edges = {}
        self.planner = own_id
        """The robot that decides."""
        self.limit = 0.0
        """Share of the airtime that flows may take together."""
        self._ways: dict[tuple[int, int], Way] = {}
        """By source and destination."""
        self._judged: tuple[int, float] | None = None
        self._retelling = Retelling()
        self._looks_at = -inf
        self._renews_at = -inf

    def is_refused(self, topic: int) -> bool:
        """Whether the planner has refused a flow of ours."""
        if topic not in self._topics or self._verdicts is None:
            return False
        return self._verdicts.word((self._own_id, topic)) is False

    def is_due(self, now: float) -> bool:
        """Whether `look` has something to do."""
        return self.is_on and now >= self._looks_at

    def has_news(self, now: float) -> bool:
        """Whether `told` would return records."""
        return self._retelling.due_at <= now

    def take(self, src: int, record: Flows | Admit, at: float) -> None:
        """Take a record that robot `src` told directly."""
        if not self.is_on or src == self._own_id:
            return
        is_news = (
            self._take_flows(src, record, at)
            if isinstance(record, Flows)
            else self._take_word(src, record, at)
        )
        if is_news:
            self._looks_at = min(self._looks_at, at)
            if self._relays and not self._all_hear(src):
                self._retelling.tell(_key(record), at)

    def newcomer(self, src: int, at: float) -> None:
        """Tell everything again, as a robot was heard for the first time, or has restarted."""
        self._table.restarted(src)
        if self._verdicts is not None:
            self._verdicts.restarted(src)
            for node in self._verdicts.of_planner(self._own_id):
                self._retelling.again((RecordType.ADMIT, node), at)
        if self._own:
            self._retelling.again((RecordType.FLOWS, self._own_id), at)

    def look(
        self, now: float, wanted: Sequence[ReservedFlow], edges: Edges, carried: float
    ) -> None:
        """Ask for the air that our flows want; decide, if this robot is the planner.

        `carried` is the share of the airtime that the access policy leaves.
        """
        self._looks_at = now + LOOK_S
        renews = now >= self._renews_at
        if renews:
            self._renews_at = now + RENEWED_S
        self._ask(wanted, now, renews=renews)
        self._table.expire(self._own_id, now)
        if not self._table.robots():
            return
        verdicts = self._words()
        if edges != self._edges:
            self._edges = edges
            self._cost_anew()
            self._judged = None
            self.planner = planner_of(edges, self._own_id)
        self.limit = max(0.0, self._share * carried - CONTROL_SHARE)
        if self.planner == self._own_id:
            self._decide(verdicts, now, renews=renews)
        verdicts.expire(now)

    def told(self, now: float) -> list[ToldOfAir]:
        """The records to be sent, each once."""
        found = []
        for key, alone_at in list(self._retelling.take(now)):
            kind, node = key
            record = self._table.record(node) if kind == RecordType.FLOWS else self._word(node)
            if record is not None:
                found.append(ToldOfAir(record, key, alone_at))
        return found

    def flows(self) -> list[TeamFlow]:
        """The flows of the team, as far as they are known."""
        verdicts = self._verdicts
        return [
            TeamFlow(
                src, flow, self._air(src, flow), self._way(src, flow.dst).relays,
                None if verdicts is None else verdicts.word((src, flow.topic)),
            )
            for src, flow in self._table.flows()
        ]  # fmt: skip

    def begin_anew(self) -> None:
        """Go on with another clock; nothing that was heard before counts."""
        self._table.begin_anew()
        self._retelling.clear()
        if self._verdicts is not None:
            self._verdicts.begin_anew()
        self._own, self._judged = (), None
        self._looks_at = self._renews_at = -inf

    def _ask(self, wanted: Sequence[ReservedFlow], now: float, *, renews: bool) -> None:
        """Tell our flows, if they have changed or are to be told anew."""
        best = sorted(wanted, key=lambda each: (each.qos, -each.priority, each.topic))
        flows = tuple(sorted(best[: self._most]))
        self._topics = frozenset(flow.topic for flow in flows if flow.qos != Qos.URGENT)
        is_news = len(flows) != len(self._own) or any(map(_differs, flows, self._own))
        if not is_news and not (renews and self._own):
            return
        if self._number is None:
            self._number = self._draw()
        self._number = (self._number + 1) % FLOWS_NUMBERS
        if is_news:
            self._own = flows
        self._table.hold(Flows(self._own_id, self._number, self._own), now)
        key = RecordType.FLOWS, self._own_id
        if is_news:
            self._retelling.tell(key, now)
        else:
            self._retelling.again(key, now)

    def _decide(self, verdicts: Verdicts, now: float, *, renews: bool) -> None:
        judged = self._table.version, self.limit
        if judged == self._judged and not renews:
            return
        self._judged = judged
        had_air = verdicts.admitted()
        claims = [
            Claim(
                (src, flow.topic), flow.qos, flow.priority, self._air(src, flow),
                (src, flow.topic) in had_air,
            )
            for src, flow in self._table.flows()
        ]  # fmt: skip
        given = admitted(claims, self.limit)
        for node in self._table.robots():
            topics = [topic for robot, topic in (claim.key for claim in claims) if robot == node]
            key = RecordType.ADMIT, node
            if verdicts.decide(node, topics, given, now):
                self._retelling.tell(key, now)
            elif renews and topics:
                verdicts.renew(node, now)
                self._retelling.again(key, now)

    def _take_flows(self, src: int, record: Flows, at: float) -> bool:
        if not is_sound(record):
            self.ignored += 1
            return False
        if record.node == self._own_id:
            # It is of an earlier life of ours, or nobody's.
            if self._number is None or is_newer_number(record.number, self._number):
                self._number = record.number
                self._renews_at = -inf
            return False
        return self._table.take(record, src, at)

    def _take_word(self, src: int, record: Admit, at: float) -> bool:
        if record.planner == self._own_id:
            self._words().overtaken(record.number)
            return False
        if record.planner != self.planner or not is_sound_word(record):
            self.ignored += 1
            return False
        return self._words().take(record, src, at)

    def _words(self) -> Verdicts:
        if self._verdicts is None:
            self._verdicts = Verdicts(self._own_id, self._draw())
        return self._verdicts

    def _word(self, node: int) -> Admit | None:
        return None if self._verdicts is None else self._verdicts.record(node)

    def _air(self, src: int, flow: ReservedFlow) -> float:
        return flow.air * FLOW_AIR_UNIT * self._way(src, flow.dst).n_sent

    def _way(self, src: int, dst: int) -> Way:
        if (src, dst) not in self._ways:
            self._ways[src, dst] = way_of(self._edges, src, dst)
        return self._ways[src, dst]

    def _cost_anew(self) -> None:
        """Find the routes anew, but keep what they cost if that has hardly changed.

        So a flow does not lose its air to the noise of what is measured.
        """
        before, self._ways = self._ways, {}
        for ends in {(src, flow.dst) for src, flow in self._table.flows()}:
            way = way_of(self._edges, *ends)
            known = before.get(ends, way).n_sent
            if abs(way.n_sent - known) <= STEADY * known:
                way = way._replace(n_sent=known)
            self._ways[ends] = way

    def _all_hear(self, teller: int) -> bool:
        """Whether all robots that we hear are known to hear the one that told something."""
        others = set(self._edges.get(self._own_id, ())) - {teller}
        return all(teller in self._edges.get(node, ()) for node in others)


def _key(record: Flows | Admit) -> RecordKey:
    kind = RecordType.FLOWS if isinstance(record, Flows) else RecordType.ADMIT
    return kind, record.node


def _differs(flow: ReservedFlow, told: ReservedFlow) -> bool:
    """Whether a flow is another one than was told, or takes another amount of air."""
    is_other = flow._replace(air=0) != told._replace(air=0)
    return is_other or abs(flow.air - told.air) > CHANGED * told.air
