"""What the root knows and does: it takes requests, and plans one round after the other."""

import math
from collections.abc import Mapping
from math import inf

from sdrlinkd.link.access.base import Slot, Wish
from sdrlinkd.link.access.requests import Due, Requests, Waiting
from sdrlinkd.link.access.reuse import stages, told
from sdrlinkd.link.access.round_plan import (
    MOST_TOLD,
    SPARE_TURNS,
    Account,
    Times,
    account,
    before,
    plan,
    shares,
)
from sdrlinkd.link.access.team import Team
from sdrlinkd.link.access.turns import ALMOST_S, Round
from sdrlinkd.link.qos import Qos
from sdrlinkd.wire import ANYBODY, Grant, Want

OPEN_S = 0.25
"""Longest time in s between two turns for robots that are not here yet."""
PATIENCE_S = 0.5
"""Time in s for which what waits somewhere gives way to all that is expected."""
LATELY_S = 1.0
"""Time in s in which airtime that was given is forgotten to 37 %."""
NUMBERS = 256
"""Count of the numbers of rounds, which wrap around."""


class Planner:
    """Plans rounds as the root `own_id`, by requests and by what the team expects."""

    def __init__(self, own_id: int, team: Team, times: Times) -> None:
        self._own_id = own_id
        self._team = team
        self._times = times
        self._requests = Requests()
        self._served_at: dict[int, float] = {}
        """When each robot had its last turn."""
        self._had_s: dict[Account, float] = {}
        """Airtime in s beyond the least turns that each robot was given lately."""
        self._number = 0
        self._own_since = inf
        """Since when we have something to send; infinity: nothing."""
        self._dues: tuple[Due, ...] = ()
        """The next urgent messages that the team expects."""
        self._made_at = -inf
        self.turn_at = 0.0
        """When our next turn begins."""
        self._turn_began, self._turn_end = -inf, -inf
        """When it began and ends, if it takes several bursts."""
        self._own: Waiting | None = None
        """What waited here when it began."""
        self.tells = True
        """Whether our next burst tells a plan."""

    def take(self, want: Want, at: float) -> None:
        """Take a request."""
        self._requests.take(want, at)
        self._team.seen(want.node, at)

    def begin(self, now: float) -> None:
        """Begin to plan, with our turn at `now`."""
        self.turn_at, self._turn_end, self.tells = now, -inf, True
        # What was asked for at another time counts no more.
        self._requests = Requests()

    def sent(self, end: float) -> None:
        """Note that a burst of ours ends at `end`; until the next plan, our turn goes on."""
        self.turn_at = max(self.turn_at, end)

    def not_sent(self, start: float) -> bool:
        """Plan anew if the burst with the last plan did not leave; returns whether that is so."""
        if self._made_at != start:
            return False
        self.turn_at = start
        return True

    @property
    def tells_at(self) -> float:
        """When the next plan is due, though we have nothing to send."""
        if self._team.present(self.turn_at):
            return self.turn_at
        return max(self.turn_at, self._served_at.get(ANYBODY, -inf) + OPEN_S)

    def slot(self, wish: Wish) -> Slot:
        """The next burst of our turn, which is as long as what waits here deserves.

        If that takes several bursts, the last one tells the plan.
        """
        times, start = self._times, max(self.turn_at, wish.earliest)
        self._dues = wish.dues
        self._own_since = min(self._own_since, start) if wish.waiting else inf
        end = self._turn_end
        if not self._turn_began <= start < end:
            self._own = wish.waiting
            if wish.waiting is None:
                end = start + times.turn_s
            else:
                self._turn_began, end = start, start + self._length_s(wish.waiting, start)
        end = max(end, start + wish.need_s + ALMOST_S)
        data_end, need_end = end - times.turn_s, start + wish.need_s
        then_s = wish.then_s if need_end + wish.then_s <= data_end else 0.0
        is_last = not then_s and end - start <= times.longest_s
        self.tells = is_last or need_end > data_end
        if self.tells:
            return Slot(start, end, end)
        self._turn_end = end
        until = min(start + times.longest_s, data_end - then_s)
        return Slot(start, until, until)

    def plan(
        self, start: float, length_s: float, reach: int, last: Round | None
    ) -> tuple[Grant, Round]:
        """Plan the round after a burst of ours of `length_s` at `start`.

        `last` is the round of the root that we have taken over from.
        """
        times, team = self._times, self._team
        present, wanted = team.present(start), self._wanted(start)
        before_s = start - self._turn_began if start < self._turn_end else 0.0
        used_s = max(0.0, before_s + length_s - 2 * times.turn_s)
        rest_s = max(0.0, times.budget_s - used_s)
        kept = math.exp((self._made_at - start) / LATELY_S)
        self._had_s = {each: kept * had_s for each, had_s in self._had_s.items()}
        self._note_had(self._own_id, self._own, used_s)
        given = shares(times._replace(budget_s=rest_s), wanted, self._had_s)
        after_s = max(length_s + times.ticks.guard_s, times.turn_s + times.react_s)
        if last is not None:
            after_s = max(after_s, last.end - start)
        begins_us = math.ceil(1e6 * after_s)
        begin = start + 1e-6 * begins_us
        ticks, places = times.ticks, team.places(self._own_id)
        is_absent = len(present) + 1 < len(team.nodes)
        turns = plan(
            times, begin, present, given, places, self._served_at,
            is_open=is_absent and (not wanted or self._is_overdue(ANYBODY, begin)),
        )  # fmt: skip
        uses = {node: ticks.count(times.turn_s + each.all_s) for node, each in wanted.items()}
        dues = self._heeded(begin)
        most = MOST_TOLD - SPARE_TURNS * bool(dues)
        found = stages(turns, uses, team.apart(start), places.parents, ticks, most)
        if dues:
            keep = self._kept(begin, dues[0].qos, given, wanted)
            found = before(dues, self._own_id, ticks, begin, found, times.turn_s, keep)
        turns = told(found, ticks)[:MOST_TOLD]
        self._number = (self._number + 1) % NUMBERS
        made = ticks.round(self._number, begin, turns)
        for turn in made.turns:
            self._served_at[turn.node] = turn.begin
            self._requests.given(turn.node, turn.end - turn.begin)
            if turn.node in wanted:
                longer_s = turn.end - turn.begin - times.turn_s
                self._note_had(turn.node, wanted[turn.node], longer_s)
        # What comes in the last turn can go on in ours.
        self.turn_at = made.end - times.ticks.guard_s + times.hears_s
        self._turn_end = -inf
        self._made_at = start
        return Grant(self._number, reach, begins_us, tuple(turns)), made

    def _kept(
        self, begin: float, qos: Qos, given: Mapping[int, float], wanted: Mapping[int, Waiting]
    ) -> dict[int, int]:
        """The ticks that robots keep in a round from `begin` on, if class `qos` is expected.

        What waits comes before what is expected in the same class, and nobody waits long for a
        least turn.
        """
        times, kept = self._times, dict[int, int]()
        for node in (*self._team.present(begin), ANYBODY):
            waiting = wanted.get(node)
            if waiting is not None and waiting.qos <= qos:
                given_s = min(given.get(node, 0.0), waiting.air_s)
                kept[node] = times.ticks.count(times.turn_s + given_s)
            elif self._is_overdue(node, begin):
                kept[node] = times.ticks.count(times.turn_s)
        return kept

    def _heeded(self, begin: float) -> tuple[Due, ...]:
        """The expected messages that may end a round from `begin` on.

        Rounds that end for each of many would leave no air for what waits. If that waits for long,
        rounds end only where they are worth their least turns.
        """
        since = min(self._own_since, self._requests.since)
        if begin < since + PATIENCE_S:
            return self._dues
        least_s = self._times.least_s(len(self._team.nodes))
        return tuple(due for due in self._dues if due.at >= begin + least_s)

    def _is_overdue(self, node: int, begin: float) -> bool:
        """Whether a robot has had no turn for a long time, in a round from `begin` on."""
        most_s = OPEN_S if node == ANYBODY else self._times.round_s(len(self._team.nodes))
        return self._served_at.get(node, -inf) < begin - most_s

    def _length_s(self, waiting: Waiting, start: float) -> float:
        """The length in s of our turn at `start`, with a PDU for the plan."""
        times, dues = self._times, self._heeded(start)
        wanted = {**self._wanted(start), self._own_id: waiting}
        given_s = shares(times, wanted, self._had_s).get(self._own_id, 0.0)
        length_s = 2 * times.turn_s + given_s
        if not dues:
            return length_s
        # Bulk ends when something urgent is due; what is urgent here goes before.
        urgent_s = waiting.air_s * (waiting.qos <= Qos.LATENCY)
        before_s = dues[0].at - start - times.ticks.guard_s
        return min(length_s, max(2 * times.turn_s + urgent_s, before_s))

    def _note_had(self, node: int, waiting: Waiting | None, given_s: float) -> None:
        """Note airtime that a robot was given for what waited there, by class."""
        first_s = 0.0 if waiting is None else max(0.0, min(given_s, waiting.air_s))
        first = Qos.BULK if waiting is None else waiting.qos
        for qos, had_s in ((first, first_s), (Qos.BULK, max(0.0, given_s - first_s))):
            of = account(node, qos)
            self._had_s[of] = self._had_s.get(of, 0.0) + had_s

    def _wanted(self, now: float) -> dict[int, Waiting]:
        requests = self._requests
        return {
            node: waiting
            for node in self._team.present(now)
            if (waiting := requests.of(node, now)) is not None
        }
