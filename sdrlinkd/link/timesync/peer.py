"""The state of one robot's clock: its estimate, and how good that is."""

from collections import OrderedDict
from enum import Enum
from typing import NamedTuple

from sdrlinkd.link.timesync.envelope import DualEnvelope
from sdrlinkd.link.timesync.estimate import Estimate
from sdrlinkd.link.timesync.paper_clock import PaperClock
from sdrlinkd.link.timesync.way import WINDOW_S
from sdrlinkd.reports import ClockReport
from sdrlinkd.wire import CLOCK_NUMBERS, UNKNOWN_WALL, Arrival, Clock

COARSE_S = 0.005
"""Bound in s above which a clock counts as coarse."""
UNKNOWN_S = 1.0
"""Bound in s above which a clock counts as unknown."""
SILENT_S = 5.0
"""Time in s without a CLOCK after which a clock is in holdover, or SILENT_PERIODS if longer."""
SILENT_PERIODS = 4
WALL_STEP_S = 0.1
"""Change of a wall clock between two CLOCKs in s that is a step, beyond the clocks' errors."""
SUSPECT_S = 60.0
"""Time in s after a step for which a robot's clocks count as unknown."""
SOLVE_S = 0.2
REMEMBERED = 16


Offset = DualEnvelope | PaperClock
"""An estimator of a clock's offset from burst times in both directions."""


class State(Enum):
    """How well a clock is known."""

    UNSYNCED = "unsynced"
    COARSE = "coarse"
    SYNCED = "synced"
    HOLDOVER = "holdover"


class Wall(NamedTuple):
    """A host's time since 1970 minus its link's clock, in ns, and its largest error in s."""

    ns: int
    error_s: float


class PeerClock:
    """One robot's CLOCK records and when they came; times are in s on our own link's clock.

    `offset` estimates by how much the robot's clock is behind ours.
    """

    def __init__(self, src: int, offset: Offset) -> None:
        self.src = src
        self.offset = offset
        self.wall: Wall | None = None
        self.refused = 0
        """CLOCK records rejected: of another boot, or not newer than the last one."""
        self.resets = 0
        """How often the robot restarted with another clock."""
        self.last_at = 0.0
        self.period_s = 0.0
        self._boot_id: int | None = None
        self._strange_boot_id: int | None = None
        self._arrivals: OrderedDict[int, float] = OrderedDict()
        self._told_left_at = -float("inf")
        self._suspect_until = -float("inf")
        """Until when the robot's clocks are not believed, as its wall clock made a step."""
        self._last_number = 0
        self._solved_at = -float("inf")
        self._has_news = False

    def hear(self, clock: Clock, at: float, own_id: int, left: dict[int, float]) -> None:
        """Take a CLOCK whose burst came at `at`; `left`: when our own CLOCKs left, by number."""
        if not self._is_acceptable(clock, at):
            self.refused += 1
            return
        if self._arrivals:
            self.period_s = at - self.last_at
        self._last_number, self.last_at = clock.number, at
        left_there = 1e-9 * clock.left_ns
        came = self._arrivals.get(clock.stamped)
        if came is not None:
            self.offset.heard(left_there, came, 0.0)
            # Later news of this CLOCK, or of earlier ones, would add nothing.
            while clock.stamped in self._arrivals:
                self._arrivals.popitem(last=False)
            self._has_news = True
        self._arrivals[clock.number] = at
        if len(self._arrivals) > REMEMBERED:
            self._arrivals.popitem(last=False)
        if clock.wall_ns != UNKNOWN_WALL:
            self._take_wall(Wall(clock.wall_ns, 1e-6 * clock.wall_error_us), at)
        for node, number, after_ns in clock.arrivals:
            left_at = left.get(number, self._told_left_at) if node == own_id else -float("inf")
            if left_at > self._told_left_at:
                self._told_left_at = left_at
                came_there = 1e-9 * (clock.left_ns + after_ns)
                self.offset.was_heard(left_at, came_there, 0.0)
                self._has_news = True
                # A CLOCK has at most one arrival of ours; any more are false.
                break
        self.estimate(at)

    def _take_wall(self, wall: Wall, at: float) -> None:
        """Take the robot's wall clock; after a step, nothing is believed for a while.

        Somebody may have set that clock, or somebody else pretends to be the robot.
        """
        if self.wall is not None:
            step_s = 1e-9 * abs(wall.ns - self.wall.ns)
            if step_s > WALL_STEP_S + wall.error_s + self.wall.error_s:
                self._suspect_until = at + SUSPECT_S
        self.wall = wall

    def arrival(self, base_s: float) -> Arrival | None:
        """The arrival of the last CLOCK heard, to be announced in our own; None if none came."""
        if not self._arrivals:
            return None
        number, at = next(reversed(self._arrivals.items()))
        return Arrival(self.src, number, round(1e9 * (at - base_s)))

    def estimate(self, now: float) -> Estimate | None:
        """Our link's clock minus the robot's, recomputed if there is news; None if unknown."""
        is_due = now - self._solved_at >= SOLVE_S or self.offset.estimate is None
        if self._has_news and is_due:
            self._has_news, self._solved_at = False, now
            self.offset.solve(now)
        return self.offset.estimate

    def state(self, now: float) -> State:
        """How well the robot's clock is known."""
        known = self.estimate(now)
        if known is None or known.bound(now) > UNKNOWN_S or now < self._suspect_until:
            return State.UNSYNCED
        if now - self.last_at > max(SILENT_S, SILENT_PERIODS * self.period_s):
            return State.HOLDOVER
        return State.COARSE if known.bound(now) > COARSE_S else State.SYNCED

    def report(self, now: float) -> ClockReport:
        """The report on the robot's clock and its CLOCK records."""
        state, known, offset = self.state(now), self.estimate(now), self.offset
        is_known = known is not None and state is not State.UNSYNCED
        return ClockReport(
            state=state.value,
            offset_ms=1e3 * known.offset(now) if known and is_known else None,
            bound_us=1e6 * known.bound(now) if known and is_known else None,
            skew_ppm=1e6 * known.skew if known and is_known else None,
            period_s=self.period_s,
            samples=offset.samples,
            steps=offset.steps,
            false_steps=offset.false_steps,
            contradicted=offset.contradicted,
            refused=self.refused,
            resets=self.resets,
        )

    def _is_acceptable(self, clock: Clock, at: float) -> bool:
        if self._boot_id is None:
            self._boot_id = clock.boot_id
            return True
        if clock.boot_id == self._boot_id and at - self.last_at > WINDOW_S:
            # Its numbers may have wrapped around.
            self._arrivals.clear()
            return True
        if clock.boot_id == self._boot_id:
            newer = (clock.number - self._last_number) % CLOCK_NUMBERS
            return 0 < newer < CLOCK_NUMBERS // 2
        if clock.boot_id != self._strange_boot_id:
            # This may be a replayed PDU; a robot that really restarted sends the same id again.
            self._strange_boot_id = clock.boot_id
            return False
        self._boot_id, self._strange_boot_id = clock.boot_id, None
        self._arrivals.clear()
        self._told_left_at = -float("inf")
        self.wall = None
        self.period_s = 0.0
        self.offset.forget()
        self.resets += 1
        return True
