"""What the root knows and does: it takes requests, and plans one round after the other."""

import math
from math import inf

from sdrlinkd.link.access.base import Slot, Wish
from sdrlinkd.link.access.requests import Due, Requests, Waiting
from sdrlinkd.link.access.round_plan import Times, before, plan, shares
from sdrlinkd.link.access.team import Team
from sdrlinkd.link.access.turns import Round
from sdrlinkd.link.qos import Qos
from sdrlinkd.wire import Grant, Want

OPEN_S = 0.25
"""Longest time in s between two turns for robots that are not here yet."""
LATELY_S = 1.0
"""Time in s in which airtime that was given is forgotten to 37 %."""
ALMOST_S = 1e-9
"""Rounding of times, in s."""
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
        self._had_s: dict[int, float] = {}
        """Airtime in s for what is not urgent that each robot was given lately."""
        self._number = 0
        self._dues: tuple[Due, ...] = ()
        """The next urgent messages that the team expects."""
        self._opened_at = -inf
        self._made_at = -inf
        self.turn_at = 0.0
        """When our next turn begins."""
        self._turn_began, self._turn_end = -inf, -inf
        """When it began and ends, if it takes several bursts."""
        self.tells = True
        """Whether our next burst tells a plan."""

    def take(self, want: Want, at: float) -> None:
        """Take a request."""
        self._requests.take(want, at)
        self._team.seen(want.node, at)

    def begin(self, now: float) -> None:
        """Begin to plan, with our turn at `now`."""
        self.turn_at, self._turn_end, self.tells = now, -inf, True

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
        return max(self.turn_at, self._opened_at + OPEN_S)

    def slot(self, wish: Wish) -> Slot:
        """The next burst of our turn, which is as long as what waits here deserves.

        If that takes several bursts, the last one tells the plan.
        """
        times, start = self._times, max(self.turn_at, wish.earliest)
        self._dues = wish.dues
        end = self._turn_end
        if wish.waiting is None:
            end = start + times.turn_s
        elif not self._turn_began <= start < end:
            self._turn_began, end = start, start + self._length_s(wish.waiting, start)
        end = max(end, start + wish.need_s + ALMOST_S)
        data_end = end - times.turn_s
        self.tells = end - start <= times.longest_s or start + wish.need_s > data_end
        if self.tells:
            return Slot(start, end, end)
        self._turn_end = end
        until = min(start + times.longest_s, data_end)
        return Slot(start, until, until)

    def plan(
        self, start: float, length_s: float, reach: int, most: int, last: Round | None
    ) -> tuple[Grant, Round]:
        """Plan the round after a burst of ours of `length_s` at `start`, with `most` turns at most.

        `last` is the round of the root that we have taken over from.
        """
        times, team = self._times, self._team
        present, wanted = team.present(start), self._wanted(start)
        before_s = start - self._turn_began if start < self._turn_end else 0.0
        used_s = max(0.0, before_s + length_s - 2 * times.turn_s)
        rest_s = max(0.0, times.budget_s - used_s)
        kept = math.exp((self._made_at - start) / LATELY_S)
        self._had_s = {node: kept * had_s for node, had_s in self._had_s.items()}
        self._had_s[self._own_id] = self._had_s.get(self._own_id, 0.0) + used_s
        given = shares(times._replace(budget_s=rest_s), wanted, self._had_s)
        for node, given_s in given.items():
            self._note_had(node, wanted[node], given_s)
        is_absent = len(present) + 1 < len(team.nodes)
        is_open = is_absent and (not wanted or start >= self._opened_at + OPEN_S)
        after_s = max(length_s + times.ticks.guard_s, times.turn_s + times.react_s)
        if last is not None:
            after_s = max(after_s, last.end - start)
        begins_us = math.ceil(1e6 * after_s)
        begin = start + 1e-6 * begins_us
        turns = plan(
            times, begin, present, given, wanted, team.places(self._own_id), self._served_at,
            is_open=is_open,
        )  # fmt: skip
        if self._dues:
            turns = before(self._dues, self._own_id, times.ticks, begin, turns, times.turn_s)
        turns = turns[:most]
        self._number = (self._number + 1) % NUMBERS
        made = times.ticks.round(self._number, begin, turns)
        for turn in made.turns:
            self._served_at[turn.node] = turn.begin
            self._requests.given(turn.node, turn.end - turn.begin)
        if is_open:
            self._opened_at = start
        # What comes in the last turn can go on in ours.
        self.turn_at = made.end - times.ticks.guard_s + times.hears_s
        self._turn_end = -inf
        self._made_at = start
        return Grant(self._number, reach, begins_us, tuple(turns)), made

    def _length_s(self, waiting: Waiting, start: float) -> float:
        """The length in s of our turn at `start`, with a PDU for the plan."""
        times, dues = self._times, self._dues
        wanted = {**self._wanted(start), self._own_id: waiting}
        given_s = shares(times, wanted, self._had_s).get(self._own_id, 0.0)
        length_s = 2 * times.turn_s + given_s
        if not dues:
            return length_s
        # Bulk ends when something urgent is due; what is urgent here goes before.
        urgent_s = waiting.air_s * (waiting.qos <= Qos.LATENCY)
        before_s = dues[0].at - start - times.ticks.guard_s
        return min(length_s, max(2 * times.turn_s + urgent_s, before_s))

    def _note_had(self, node: int, waiting: Waiting, given_s: float) -> None:
        """Note airtime that a robot was given, as far as it is not for something urgent."""
        urgent_s = waiting.air_s * (waiting.qos <= Qos.LATENCY)
        self._had_s[node] = self._had_s.get(node, 0.0) + max(0.0, given_s - urgent_s)

    def _wanted(self, now: float) -> dict[int, Waiting]:
        requests = self._requests
        return {
            node: waiting
            for node in self._team.present(now)
            if (waiting := requests.of(node, now)) is not None
        }
