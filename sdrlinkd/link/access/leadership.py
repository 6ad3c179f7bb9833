"""Who plans the turns of the team: the root, and how it is found, followed, replaced and lost.

The best root is the robot from which a PDU reaches all others with the fewest tries, of these the
lowest. Everybody follows the best root it has heard of. A robot that reaches all with fewer takes
over in its own turn. A root that is silent for some rounds is lost. Then the others wait, each a
turn longer than the one before it, until one of them plans. They await silence for that, but not
for long: robots that nobody here can read may be heard all the time.
"""

from math import inf

from sdrlinkd.link.access.steps import after
from sdrlinkd.link.access.tdma_states import GRANT_STEPS, Happens, State
from sdrlinkd.link.access.team import PRESENT_S, Team
from sdrlinkd.link.access.turns import Round
from sdrlinkd.link.traits import Sensed
from sdrlinkd.wire import FAR, Frame

LISTEN_S = 1.0
"""A robot plans rounds of its own after hearing no plan for this time in s, and some rounds."""
BETTER_S = 1.0
"""Time in s for which a robot must have been a better root before it takes over."""
LOST_ROUNDS = 2.2
"""Rounds without a plan, for each hop to the root, after which the root is lost."""
STEADY_S, PASSED_ON_S = 0.5, 0.3
"""Time in s for which plans have come over a weak link without a gap, so that they count; and the
longest gap in s of plans that are passed on, as not all of them are."""
PATIENCE_S = 0.3
"""Time in s after the loss of a root for which a silent round is awaited, beside that round."""
MAX_LEVEL = 255


class Leadership:
    """Whether robot `own_id` listens for plans, makes them, or follows those of another robot.

    `round_s` is the longest round, `turn_s` the time in which a robot can begin to plan and be
    heard.
    """

    def __init__(self, own_id: int, team: Team, round_s: float, turn_s: float) -> None:
        self._own_id = own_id
        self._team = team
        self._round_s = round_s
        self._turn_s = turn_s
        self.role = State.LISTENING
        """Whether we listen for plans, make them, or follow those of another robot."""
        self.root, self.level = own_id, 0
        """Whose plans are kept, and how many hops away it is."""
        self.rank = FAR, own_id
        """How good the root is: tries to the farthest robot, and its id; less is better."""
        self._parent = own_id
        self._lost = -1, 0, 0.0
        """The lost root, as (root, our level then, time until which it is not accepted)."""
        place = team.nodes.index(own_id)
        listen_s = max(LISTEN_S, 3 * round_s) + place * (LISTEN_S / 4 + round_s)
        self._begins_at = listen_s if place else 2 * round_s
        self._told_at = -inf
        """When a plan of our root came last that counts."""
        self._runs: dict[int, tuple[float, float]] = {}
        """By root, since when its plans have come without a gap, and the last one of them."""
        self._has_turn = False
        """Whether the last plan had a turn of ours."""
        self._better_since = inf
        """Since when we would be a better root."""

    @property
    def doing(self) -> str:
        """Who plans, for people."""
        if self.is_root:
            return "planned here"
        if not self.follows:
            return "listening for a plan"
        away = f", {self.level} hops away" if self.level > 1 else ""
        return f"planned by robot {self.root}{away}"

    @property
    def is_root(self) -> bool:
        """Whether we plan."""
        return self.role is State.ROOT

    @property
    def follows(self) -> bool:
        """Whether we follow another robot."""
        return self.role is State.FOLLOWER

    @property
    def takes_over(self) -> bool:
        """Whether we should plan, as we are a better root than the one that we follow."""
        return self.follows and self._told_at > self._better_since + BETTER_S

    def begins(self, now: float, sensed: Sensed) -> bool:
        """Begin to plan if nobody does; returns whether that is so."""
        if self.role is State.LISTENING:
            if now < self._begins_at or not self._is_silent(now, sensed):
                return False
            self.begin(now, Happens.BEGINS)
            return True
        if not self.follows:
            return False
        before = sum(node < self._own_id and node != self.root for node in self._team.present(now))
        since = now - before * self._turn_s
        if not self.is_lost(since):
            return False
        if not (self._is_silent(now, sensed) or self.is_lost(since - self._round_s - PATIENCE_S)):
            return False
        self._lost = self.root, self.level, now + 2 * PRESENT_S
        self.begin(now, Happens.LOSES)
        return True

    def begin(self, now: float, happens: Happens) -> None:
        """Be the root from now on."""
        self.role = after(GRANT_STEPS, self.role, happens)
        self.root, self.level, self._parent = self._own_id, 0, self._own_id
        self._better_since = inf
        self.look(now)

    def end(self) -> None:
        """Neither plan nor follow from now on."""
        self.role = after(GRANT_STEPS, self.role, Happens.ENDS)
        self.root, self.level, self._parent = self._own_id, 0, self._own_id
        self.rank, self._better_since = (FAR, self._own_id), inf

    def place(self, now: float) -> int:
        """How many robots that are here would be better roots than we."""
        here, own = self._team.present(now), self._own_rank(now)
        everybody, reach = {self._own_id, *here}, self._team.reach
        return sum((reach(node, everybody - {node}), node) < own for node in here)

    def is_lost(self, now: float) -> bool:
        """Whether the root that we follow has told no plan for long."""
        # Plans without a turn of ours are not always passed on to us.
        lost_s = self.level * LOST_ROUNDS * self._round_s if self._has_turn else LISTEN_S
        return self.follows and now > self._told_at + lost_s

    def look(self, now: float) -> None:
        """As the root: note how far the others are."""
        self.rank = self._own_rank(now)

    def take(
        self, src: int, frame: Frame, reach: int, at: float, found: Round, *, is_weak: bool
    ) -> tuple[bool, bool]:
        """Take the plan of a round that robot `src` tells: (whether we follow it, whether its root
        is new).

        `is_weak`: most PDUs get lost with such a signal. Then the plan came by luck, and would
        silence us until the next one does. It only counts where plans come all the time.
        """
        root, level = frame.root, frame.level + 1
        if root == self._own_id or level > MAX_LEVEL:
            return False, False
        if root == self._lost[0] and level > self._lost[1] and at < self._lost[2]:
            # This robot has not noticed yet that the root is lost.
            return False, False
        rank = reach, root
        counts = self._is_steady(src, root, at) or not is_weak
        is_new = not (self.follows and root == self.root)
        if not is_new:
            if level < self.level or src == self._parent:
                self.level, self._parent = level, src
        elif counts and (
            # Who told us the plans of our root follows another one now, and tells no more of those.
            src == self._parent
            or self.role is State.LISTENING
            or rank < self.rank
            or self.is_lost(at)
        ):
            self.role = after(GRANT_STEPS, self.role, Happens.FOLLOWS)
            self.root, self.level, self._parent = root, level, src
        else:
            return False, False
        self.rank = rank
        self._has_turn = any(turn.node == self._own_id for turn in found.turns)
        if counts:
            self._told_at = max(at, self._told_at)
        if self._own_rank(at)[0] >= reach:
            self._better_since = inf
        elif self._better_since == inf:
            self._better_since = at
        return True, is_new

    def _is_steady(self, src: int, root: int, at: float) -> bool:
        """Whether plans of a root, one of which robot `src` tells, have come all the time."""
        gap_s = LOST_ROUNDS * self._round_s
        if src != root:
            gap_s = max(gap_s, PASSED_ON_S)
        since, last = self._runs.get(root, (at, at))
        if at > last + gap_s:
            since = at
        self._runs[root] = since, max(at, last)
        return at >= since + STEADY_S

    def _own_rank(self, now: float) -> tuple[int, int]:
        return self._team.reach(self._own_id, self._team.present(now)), self._own_id

    def _is_silent(self, now: float, sensed: Sensed) -> bool:
        """Whether nobody has sent for a round, as the root's team would."""
        return sensed.idle_since <= max(0.0, now - self._round_s)
