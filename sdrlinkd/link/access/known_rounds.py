"""The rounds that a robot knows of, and its turns in them."""

from collections.abc import Iterator

from sdrlinkd.link.access.round_plan import Times
from sdrlinkd.link.access.team import Places
from sdrlinkd.link.access.turns import Round, Turn
from sdrlinkd.wire import Grant


class KnownRounds:
    """The rounds that go on or will begin, as far as robot `own_id` knows them.

    Two plans whose rounds begin less than a least turn apart may be the same.
    """

    def __init__(self, own_id: int, times: Times) -> None:
        self._own_id = own_id
        self._same_s = times.turn_s
        self._root_s = times.root_s
        """Longest time from the end of a round until the plan of the next one is known."""
        self._had_turn = False
        """Whether a plan of this root had a turn of ours."""
        self._rounds: list[Round] = []
        self.plan: tuple[float, Grant] | None = None
        """The root's last plan, and the time from which its begin counts."""
        self._passed_on = -1
        """Number of the round whose plan we passed on last."""

    @property
    def last(self) -> Round | None:
        """The last round that is known."""
        return self._rounds[-1] if self._rounds else None

    def lacks(self, now: float) -> str:
        """What has not come that should have: the next plan, or a first turn of ours."""
        last = self.last
        if last is None or now > last.end + self._root_s:
            return "a plan"
        return "" if self._had_turn else "a turn"

    def forget(self) -> None:
        """Begin anew with another root."""
        self._rounds, self.plan, self._had_turn = [], None, False

    def made(self, found: Round) -> None:
        """Go on with a round of our own."""
        self._rounds = [found]

    def take(self, since: float, grant: Grant, found: Round) -> bool:
        """Take the round of a plan that counts from `since`; returns whether it is a new one."""
        last = self.last
        is_same = last is not None and last.number == found.number
        if is_same and abs(self._rounds[-1].begin - found.begin) < self._same_s:
            # Another robot has passed on the same plan.
            return False
        self.plan = since, grant
        self._had_turn |= any(turn.node == self._own_id for turn in found.turns)
        self._rounds = [*(each.until(found.begin) for each in self._rounds[-1:]), found]
        return True

    def own_turns(self) -> Iterator[Turn]:
        """The turns in which we may send, in order."""
        for each in self._rounds:
            yield from each.of(self._own_id)

    def has_turn(self, node: int, at: float, slack_s: float) -> bool | None:
        """Whether a robot has a turn at `at`; None: no round is known for that time."""
        for each in self._rounds:
            if each.begin - slack_s <= at <= each.end:
                turns = each.of(node)
                return any(turn.begin - slack_s <= at <= turn.end for turn in turns)
        return None

    def beside(self, turn: Turn) -> set[int]:
        """The robots with turns in the round that a turn belongs to."""
        return {each.node for known in self._rounds if turn in known.turns for each in known.turns}

    def must_pass_on(self, places: Places) -> bool:
        """Whether a robot in the last plan has to hear it from us, and has not yet."""
        if self.plan is None or self.plan[1].number == self._passed_on:
            return False
        return any(
            # Who is nowhere may be near to anybody.
            node not in places.levels or places.is_behind(node, self._own_id)
            for node, ticks in self.plan[1].turns
            if ticks
        )

    def pass_on(self) -> tuple[float, Grant] | None:
        """The plan, which is passed on now, and the time from which its begin counts."""
        if self.plan is not None:
            self._passed_on = self.plan[1].number
        return self.plan
