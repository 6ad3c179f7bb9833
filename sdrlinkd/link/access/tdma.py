"""`tdma`: each node has its own time slots, synchronized by the bursts it hears."""

import math
from collections.abc import Sequence
from math import inf
from random import Random
from struct import pack

from sdrlinkd.link.access.base import BusyChannel, Slot, Wish, next_on_grid
from sdrlinkd.link.access.phase import Phase
from sdrlinkd.link.access.sightings import Sightings
from sdrlinkd.link.access.steps import after
from sdrlinkd.link.access.tdma_states import STEPS, Happens, State
from sdrlinkd.link.traits import Sensed
from sdrlinkd.wire import Frame, crc16

LISTEN_S = 2.5
"""A robot starts a schedule after hearing none for this time in s, plus 1 s per robot before it."""
QUIET_S = 0.05
"""The lowest robot starts a schedule after this much silence in s, and at least one frame."""
FORGET_S = 3.0
"""Time in s without news of a root after which it counts as lost. For twice that time, its schedule
is accepted only from robots as close to it as we were."""
LISTEN_SHARE = 0.25
"""Share of its own slots in which a root without followers listens: others may be using them."""
MAX_LEVEL = 255
PAUSE_AFTER = 2 / 3
UNSCHEDULED = 3
"""Number of beacons without a schedule after which a robot counts as having none."""


class Tdma(BusyChannel):
    """TDMA: slots in the order of `nodes`, repeated; the last `guard_s` of each slot is silent.

    A burst that starts in the first two thirds of a slot ends there, so that an urgent message that
    arrives during its robot's slot does not have to wait for the next one.

    All robots keep the schedule of the lowest robot known to them, directly or through others (the
    root). Each robot announces it with its own hop count (level). With `reuse`, a slot whose owner
    is silent, or silent again, is open to the others in order, one per `minislot_s`. A robot that
    knows of a robot it cannot hear does not take part, as that robot may be sending.

    Robots that kept their own schedules out of each other's range may meet again with overlapping
    slots. If all of them sent in all of their slots, none would hear another. So a root without
    followers for FORGET_S listens in some of its slots, at random, and adopts the others' phase.
    """

    keeps_schedule = True

    def __init__(
        self,
        own_id: int,
        nodes: Sequence[int],
        slot_s: float,
        guard_s: float,
        minislot_s: float,
        reuse: bool,
        rng: Random,
        *,
        look_s: float,
        detect_s: float,
        gap_s: float,
    ) -> None:
        super().__init__()
        self._own_id = own_id
        self._nodes = list(nodes)
        self._rank = self._nodes.index(own_id)
        self.slot_s = slot_s
        self.guard_s = guard_s
        """Time in s at the end of each slot in which nobody sends."""
        self.minislot_s = minislot_s
        """Time in s between the starts of two robots in a slot whose owner is silent."""
        self._reuse = reuse
        self._rng = rng
        self._look_s = look_s
        self._detect_s = detect_s
        self._gap_s = gap_s
        self.round_s = self._frame_s = slot_s * len(nodes)
        self.share = (slot_s - guard_s) / self._frame_s
        # With reuse, another robot may have started in our slot.
        self.step_s = reuse * minislot_s * len(nodes)
        # Rounded to µs, as sent on the air.
        times = (round(1e6 * slot_s), round(1e6 * guard_s), round(1e6 * minislot_s) * reuse)
        self._times_crc = crc16(pack(">III", *times) + bytes(nodes))
        self._origin = 0.0
        self._phase = Phase(self._frame_s, guard_s)
        self._root, self._level, self._parent = own_id, 0, own_id
        self._lost = (-1, 0, 0.0)
        """The lost root, as (root, our level then, time until which it is not accepted)."""
        self.role = State.LISTENING
        """State of the schedule: listening, root or follower."""
        self._told_at = 0.0
        self._begins_at = LISTEN_S + sum(node < own_id for node in nodes)
        self._strangers, self._outsiders = Sightings(), Sightings()
        """Robots that announce another schedule."""
        self._unscheduled = Sightings()
        """Beacons by robot since it last announced a schedule; with a schedule, each has one."""
        self._heard_at: dict[int, float] = {}
        self._followed_at = 0.0
        self._listens = (-inf, False)
        """Our latest slot, as (its start, whether we only listen in it)."""
        self._told_of_at: dict[int, float] = {}

    @property
    def state(self) -> str:
        """Policy, times, and whose schedule is kept, for people."""
        doing = "listening for a schedule"
        if self.role is not State.LISTENING:
            doing = f"schedule of robot {self._root}"
            if self.role is State.FOLLOWER:
                doing += f", {self._level} hops away"
        return (
            f"tdma: {len(self._nodes)} slots of {self.slot_s * 1e3:.3g} ms, guard "
            f"{self.guard_s * 1e3:.3g} ms; {doing}"
        )

    @property
    def lacks(self) -> str:  # type: ignore[override]
        """A schedule, while listening for one."""
        return "a schedule" if self.role is State.LISTENING else ""

    def carries(self, burst_s: float) -> float:
        """Share of airtime of bursts, as slots lose guard times and gaps."""
        open_s = self.slot_s - self.guard_s
        return open_s / self.slot_s * burst_s / (burst_s + self._gap_s)

    def slot(self, wish: Wish) -> Slot | None:
        """A time in our own slot, or in one that its owner does not use."""
        earliest, need_s, sensed = wish.earliest, wish.need_s, wish.sensed
        if self.role is State.LISTENING:
            if earliest < self._begins_at and not self._is_first(earliest, sensed):
                return None
            self._go(Happens.BEGINS)
            self._begin(earliest)
            self._followed_at = earliest
        self._forget(earliest)
        number = math.floor((earliest - self._origin) / self.slot_s)
        for each in (number, number + 1):
            begin = self._origin + each * self.slot_s
            end = begin + self.slot_s - self.guard_s
            turn = (self._rank - each) % len(self._nodes)
            if turn == 0 and self._listens_through(begin, earliest):
                continue
            start = self._start(begin, turn, earliest, sensed)
            if start is not None and start + need_s <= end:
                if start >= earliest + self._look_s:
                    # Too early: decide at the last query before that start.
                    return None
                pause = begin + PAUSE_AFTER * (self.slot_s - self.guard_s)
                planned_end = pause if start + need_s <= pause else end
                if self._reuse:
                    # With reuse, others rely on a start at exactly this time.
                    return Slot.exact(start, planned_end)
                return Slot(start, planned_end, end)
        return None

    def heard(self, src: int, at: float, is_relayed: bool, *, is_weak: bool = False) -> None:
        """Note that we hear robot `src` directly."""
        if not is_relayed:
            self._heard_at[src] = at

    def told_of(self, node: int, at: float, by: int, *, is_weak: bool = False) -> None:
        """Note that robot `node` exists, whether we hear it or not."""
        if node != self._own_id:
            self._told_of_at[node] = at

    def beacon(self, src: int, at: float) -> None:
        """Note a beacon of robot `src`, which should come with a schedule."""
        self._unscheduled.add(src, at)

    def frame(self, start: float) -> Frame | None:
        """Our schedule, for a burst that leaves at `start`; None while listening."""
        if self.role is State.LISTENING:
            return None
        self._forget(start)
        phase_s = (start - self._origin) % self._frame_s
        return Frame(self._root, self._level, self._times_crc, round(1e6 * phase_s))

    def take_frame(self, src: int, frame: Frame, at: float) -> None:
        """Follow the lowest root, over the fewest hops."""
        self._unscheduled.clear(src)
        if src not in self._nodes or frame.root not in self._nodes:
            # It may be anybody's; those in `nodes` are who share the channel.
            self._outsiders.add(src, at)
            return
        if frame.schedule != self._times_crc:
            self._strangers.add(src, at)
            return
        self._strangers.clear(src)
        self._forget(at)
        origin = at - 1e-6 * frame.phase_us
        told = (frame.root, frame.level + 1)
        if frame.root == self._own_id:
            self._followed_at = at
        if frame.root >= self._own_id:
            # They will follow us; until then we adopt their phase.
            if self.role is State.LISTENING:
                self._go(Happens.ADOPTS)
                self._begin(origin)
                self._followed_at = at
            elif self._is_alone(at):
                self._go(Happens.ADOPTS)
                self._begin(origin)
        elif frame.root == self._lost[0] and told[1] > self._lost[1] and at < self._lost[2]:
            # This robot has not noticed yet that the root is lost.
            return
        elif frame.level < MAX_LEVEL and (
            src == self._parent or told < (self._root, self._level) or self.role is State.LISTENING
        ):
            if self._is_alone(at):
                # Whoever has no followers moves nobody else.
                self._phase.keep(origin)
            kept = self._phase.follow(frame.root, origin, at)
            if kept is None:
                # Anybody could move the schedule with a single record.
                return
            self._go(Happens.FOLLOWS)
            self._root, self._level, self._parent = *told, src
            self._origin, self._told_at = kept, at

    def notices(self, now: float) -> list[str]:
        """Sentences on robots that keep another schedule or none."""
        outside = [
            f"robot {src} announces a tdma schedule and is ignored: it or the schedule's root is "
            "not in access.nodes; list all robots there, at every robot, or look who sends it"
            for src in self._outsiders.lately(now)
        ]
        without = [
            f"robot {src} keeps no tdma schedule: its bursts fall into other robots' slots; give "
            "it the same [access], and a radio of the same kind where access.policy is auto"
            for src in self._unscheduled.lately(now, UNSCHEDULED)
        ]
        differing = [
            f"robot {src} keeps a different tdma schedule; give both the same nodes, slot_s, "
            f"guard_s and minislot_s in [access] (ours: {self.state})"
            for src in self._strangers.lately(now)
        ]
        return outside + without + differing

    def _begin(self, origin: float) -> None:
        """Keep a schedule of our own whose frames start at `origin`."""
        self._origin = origin
        self._phase.keep(origin)

    def _go(self, happens: Happens) -> None:
        self.role = after(STEPS, self.role, happens)

    def _is_first(self, earliest: float, sensed: Sensed) -> bool:
        """Whether we are the lowest robot and have heard nobody so far."""
        lowest = self._own_id == min(self._nodes)
        return lowest and earliest >= max(QUIET_S, self._frame_s) and sensed.idle_since <= 0

    def _forget(self, now: float) -> None:
        """Become the root, by our own clock, after FORGET_S without news of our root."""
        if self.role is State.FOLLOWER and now - self._told_at > FORGET_S:
            self._go(Happens.LOSES)
            self._lost = (self._root, self._level, now + 2 * FORGET_S)
            self._root, self._level, self._parent = self._own_id, 0, self._own_id
            self._followed_at = now

    def _is_alone(self, now: float) -> bool:
        """Whether we follow nobody and have had no follower for FORGET_S."""
        is_root = self.role is not State.FOLLOWER
        return is_root and now - self._followed_at >= FORGET_S

    def _listens_through(self, begin: float, now: float) -> bool:
        """Whether we only listen in our slot that starts at `begin`, to hear who sends in it."""
        if len(self._nodes) == 1 or not self._is_alone(now):
            return False
        if abs(begin - self._listens[0]) > self.slot_s / 2:
            self._listens = (begin, self._rng.random() < LISTEN_SHARE)
        return self._listens[1]

    def _knows_of_hidden(self, now: float) -> bool:
        """Whether others hear a robot that we do not hear."""
        return any(
            now - told_at < FORGET_S and now - self._heard_at.get(node, -inf) >= FORGET_S
            for node, told_at in self._told_of_at.items()
        )

    def _start(self, begin: float, turn: int, earliest: float, sensed: Sensed) -> float | None:
        """Earliest start for us in the slot at `begin`, as the robot `turn` after its owner."""
        if turn == 0 and (earliest <= begin or not self._reuse):
            return max(begin, earliest)
        if turn == 0 and begin < self.own_end and earliest <= self.own_end + 2 * self._gap_s:
            return earliest
        if not self._reuse or earliest < begin or self._knows_of_hidden(earliest):
            return None
        idle_since = self.idle_since(sensed)
        if idle_since is None:
            return None
        n = len(self._nodes)
        if idle_since <= begin:
            first = begin + turn * self.minislot_s
        else:
            first = idle_since + (turn + 1) * self.minislot_s
        start = next_on_grid(first, n * self.minislot_s, earliest)
        return start if start <= sensed.until + self.minislot_s - self._detect_s else None
