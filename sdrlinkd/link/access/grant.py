"""`grant`: one robot of the team gives turns to those that want the most urgent things.

The root plans one round after the other. Each begins with its own turn, in which it tells the plan;
then all others send in theirs. A robot sends only in turns of a plan that it has heard, so a lost
plan costs turns and never a collision.
"""

from collections.abc import Sequence
from math import inf
from random import Random

from sdrlinkd.link.access.base import BusyChannel, Slot, Wish
from sdrlinkd.link.access.by_request import ByRequest
from sdrlinkd.link.access.heard_frames import HeardFrames
from sdrlinkd.link.access.known_rounds import KnownRounds
from sdrlinkd.link.access.leadership import Leadership
from sdrlinkd.link.access.open_turns import OpenTurns
from sdrlinkd.link.access.own_request import OwnRequest
from sdrlinkd.link.access.planner import PATIENCE_S, Planner
from sdrlinkd.link.access.requests import Waiting
from sdrlinkd.link.access.round_plan import PLAN_SIZE, Times
from sdrlinkd.link.access.strays import Strays
from sdrlinkd.link.access.tdma_states import Happens
from sdrlinkd.link.access.team import Team
from sdrlinkd.link.access.turns import ALMOST_S, Turn
from sdrlinkd.link.access.urgent_turns import UrgentTurns
from sdrlinkd.link.paths import Edges
from sdrlinkd.link.qos import Qos
from sdrlinkd.wire import ANYBODY, LAST_PLAN, WANT_SIZE, Frame, Record
from sdrlinkd.wire import Grant as GrantRecord
from sdrlinkd.wire import Want as WantRecord


class Grants(BusyChannel):
    """Turns by request, planned by the root: the robot nearest to all, of these the lowest.

    Robots tell the root what waits (WANT). Everybody present gets a short turn, and those with the
    most urgent messages a longer one. Robots that hear the root tell its plan to those that do not.
    """

    least_room = PLAN_SIZE + WANT_SIZE
    """For a plan and a request."""
    patience_s = PATIENCE_S
    ahead_s = 0.0
    """How long the last round took: what we ask for now is given after one."""

    def __init__(
        self, own_id: int, nodes: Sequence[int], times: Times, rng: Random, *, lead_s: float,
        look_s: float, gap_s: float,
    ) -> None:  # fmt: skip
        super().__init__()
        self._own_id = own_id
        self._times = times
        self._lead_s = lead_s
        self._look_s = look_s
        self._gap_s = gap_s
        self.round_s = times.round_s(len(nodes))
        self.share = times.budget_s / len(nodes) / self.round_s
        self._frames = HeardFrames(nodes, times.schedule(nodes))
        self._strays = Strays()
        self._team = Team(own_id, nodes)
        begin_s = times.turn_s + times.ticks.guard_s + times.react_s
        self.leads = Leadership(own_id, self._team, self.round_s, begin_s)
        """Whose plans are kept."""
        self._planner = Planner(own_id, self._team, times)
        self._request = OwnRequest(own_id, times, self.round_s)
        self._rounds = KnownRounds(own_id, times)
        self._urgent = UrgentTurns(own_id, len(nodes), times)
        """Who always asks for urgent turns."""
        self._behind: dict[int, WantRecord] = {}
        """Requests to pass on to the root."""
        self._open = OpenTurns(rng)
        self._asked_at = -inf  # Or when we heard somebody last.
        self.ends = self.has_ended = False
        """Whether our next plan is the last one; and whether a last one was told or heard."""

    @property
    def state(self) -> str:
        """Policy, times, and whose plans are kept, for people."""
        doing = self.leads.doing
        if self.leads.follows and self.lacks:
            doing += f", without {self.lacks}"
        return (
            f"grant: {len(self._team.nodes)} robots, rounds of at most {1e3 * self.round_s:.3g} "
            f"ms, guard {1e3 * self._times.ticks.guard_s:.3g} ms; {doing}"
        )

    @property
    def lacks(self) -> str:  # type: ignore[override]
        """A plan, while listening for one, and if one was not heard: no turn is known then."""
        leads, lacks = self.leads, self._rounds.lacks(self._asked_at)
        return "" if leads.is_root else lacks if leads.follows else "a plan"

    def mean_wait_s(self, qos: Qos) -> float:
        """Mean wait in s: half a round."""
        return self.round_s / 2

    def carries(self, burst_s: float) -> float:
        """Share of airtime of requested turns, less the gaps between bursts."""
        return self._times.carries(len(self._team.nodes)) * burst_s / (burst_s + self._gap_s)

    @property
    def by_request(self) -> ByRequest:  # type: ignore[override]
        """This policy."""
        return self

    @property
    def plans(self) -> bool:
        """Whether we are the root."""
        return self.leads.is_root

    @property
    def is_far(self) -> bool:
        """Whether we do not hear the root."""
        return self.leads.level > 1

    @property
    def tells_at(self) -> float:  # type: ignore[override]
        """Time from which we must be asked, as others wait for the plan."""
        if self.leads.is_root:
            return self._planner.tells_at - self._look_s
        if self._must_pass_on() or self.leads.takes_over:
            own = (turn for turn in self._rounds.own_turns() if turn.node == self._own_id)
            return min((turn.begin for turn in own), default=inf) - self._look_s
        return inf

    def turn_at(self, earliest: float) -> float:
        """When we may send next, at `earliest` or later, as far as known."""
        if self.leads.is_root:
            return max(earliest, self._planner.turn_at)
        for turn in self._rounds.own_turns():
            if turn.end > earliest:
                return max(earliest, turn.begin)
        return inf if self.leads.follows else earliest

    def slot(self, wish: Wish) -> Slot | None:
        """Our turn, from its begin or from `earliest` on."""
        earliest, leads = wish.earliest, self.leads
        self._asked_at = max(self._asked_at, wish.sensed.until)
        # While our last burst is on the air, `earliest` is not the present.
        latest = min(earliest, wish.sensed.until + self._lead_s) + self._look_s
        if leads.begins(earliest, wish.sensed):
            self._begin_anew()
            self._planner.begin(earliest)
        if leads.is_root:
            return None if self._planner.turn_at >= latest else self._planner.slot(wish)
        for turn in self._rounds.own_turns():
            start = max(turn.begin, earliest)
            if start + wish.need_s <= turn.end + ALMOST_S:
                if start >= latest:
                    # Too early: decide at the last query before that start.
                    return None
                if turn.node == ANYBODY and not self._open.tries(turn.begin, self._absent(turn)):
                    continue
                if leads.takes_over and turn.node == self._own_id:
                    leads.begin(start, Happens.LOSES)
                    self._planner.begin(start)
                return Slot(start, turn.end, turn.end)
        return None

    @property
    def must_tell(self) -> bool:
        """Whether our next burst tells the plan, or requests of robots behind us."""
        if self.leads.is_root:
            return self._planner.tells
        return self._must_pass_on() or bool(self._behind)

    def request(self, start: float, left: Waiting | None) -> WantRecord | None:
        """What to ask the root for, unless it knows."""
        if self.leads.is_root:
            self._urgent.waits(left, start)
        elif left is not None:
            return self._request.of(left, start)
        return None

    def requested(self, want: WantRecord, start: float) -> None:
        """Note what the root knows from now on."""
        self._request.told(want, start)
        self._urgent.asks(want, start)

    def told(self, start: float, length_s: float, room: int) -> list[Record]:
        """The plan of the next round, or the one that we pass on, with requests to pass on."""
        leads = self.leads
        if leads.is_root:
            leads.look(start)
            # Until its end, the round of a root that we have taken over from goes on.
            last = self._rounds.last
            grant, made = self._planner.plan(start, length_s, leads.rank[0], last)
            if self.ends:
                grant, self.has_ended = grant._replace(turns=LAST_PLAN), True
            self._rounds.made(made)
            self._urgent.take(made)
            return [Frame(self._own_id, 0, self._frames.schedule, 0), grant]
        records: list[Record] = []
        plan = self._rounds.pass_on() if self._must_pass_on() else None
        if plan is not None:
            phase_us = max(0, round(1e6 * (start - plan[0])))
            records += [Frame(leads.root, leads.level, self._frames.schedule, phase_us), plan[1]]
            room -= PLAN_SIZE
        for node in [*self._behind][: room // WANT_SIZE]:
            records.append(self._behind.pop(node))
        return records

    def sent(self, end: float, src: int | None) -> None:
        """Note that, as the root, our turn lasts at least until `end`."""
        super().sent(end, src)
        self._planner.sent(end)

    def not_sent(self, start: float) -> None:
        """Plan anew if the burst with the plan did not leave."""
        super().not_sent(start)
        if self._planner.not_sent(start):
            self._rounds.forget()

    def heard(self, src: int, at: float, is_relayed: bool, *, is_weak: bool = False) -> None:
        """Note that we hear robot `src` directly."""
        self._asked_at = max(self._asked_at, at)
        if is_relayed:
            return
        self._team.told_of(src, at, self._own_id, is_weak=is_weak)
        has_turn = self._rounds.has_turn(src, at, self._times.ticks.guard_s)
        if has_turn is not None and src != self.leads.root and not is_weak:
            self._strays.heard(src, at, has_turn=has_turn)

    def told_of(self, node: int, at: float, by: int, *, is_weak: bool = False) -> None:
        """Note that robot `by` hears robot `node`."""
        self._team.told_of(node, at, by, is_weak=is_weak)

    def know_links(self, edges: Edges) -> None:
        """Take the links of the team, as its LSAs tell them."""
        self._team.learn(edges)

    def take_frame(self, src: int, frame: Frame, at: float) -> None:
        """Remember whose plan the next GRANT of this burst tells."""
        self._frames.take(src, frame, at)

    def take_want(self, src: int, want: WantRecord, at: float) -> None:
        """Take what a robot wants, or pass it on to the root."""
        if want.node not in self._team.nodes or want.node == self._own_id:
            return
        self._urgent.asks(want, at)
        if self.leads.is_root:
            self._planner.take(want, at)
        elif self._team.places(self.leads.root).is_behind(want.node, self._own_id):
            self._behind[want.node] = want

    def take_grant(self, src: int, grant: GrantRecord, at: float, *, is_weak: bool = False) -> None:
        """Follow a plan of the best root known, as robot `src` told it."""
        frame = self._frames.of(src, at)
        if frame is None:
            return
        since = at - 1e-6 * frame.phase_us
        found = self._times.ticks.round(grant.number, since + 1e-6 * grant.begins_us, grant.turns)
        if not found.is_sound(at, 2 * self.round_s):
            return
        follows, is_new = self.leads.take(src, frame, grant.reach, at, found, is_weak=is_weak)
        if is_new:
            self._begin_anew()
        self.has_ended = follows and grant.turns == LAST_PLAN
        last = self._rounds.last
        if follows and self._rounds.take(since, grant, found):
            self._request.given(found)
            self._urgent.take(found)
            if last is not None:
                self.ahead_s = min(max(0.0, found.begin - last.begin), self.round_s)

    def notices(self, now: float) -> list[str]:
        """Sentences on robots that keep another schedule, or none, or always want urgent."""
        found = self._frames.notices(self.state, now) + self._strays.notices(now)
        return found + self._urgent.notices(now)

    def begin(self, wish: Wish, start: float) -> Slot:
        """Plan from our burst at `start` on, where nobody did so before."""
        self.leads.begin(start, Happens.BEGINS)
        self._begin_anew()
        self._planner.begin(start)
        return self._planner.slot(wish._replace(earliest=start))

    def end(self) -> None:
        """Plan and follow nobody any more."""
        self.leads.end()
        self._begin_anew()
        self.ends = self.has_ended = False

    def _begin_anew(self) -> None:
        """Forget the rounds of another root."""
        self._rounds.forget()
        self._request.forget()

    def _must_pass_on(self) -> bool:
        """Whether a robot in the plan has to hear it from us, and has not yet."""
        places = self._team.places(self.leads.root)
        return self.leads.follows and self._rounds.must_pass_on(places)

    def _absent(self, turn: Turn) -> int:
        """How many robots have no turn of their own in the round of this one."""
        return len({*self._team.nodes} - {*self._rounds.beside(turn), self.leads.root})
