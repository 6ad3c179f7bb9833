"""`tdma`: each node has slots of its own, and clocks from what it hears."""

import math
from binascii import crc_hqx
from collections.abc import Sequence
from math import inf
from random import Random
from struct import pack

from sdrlinkd.link.access.base import BusyChannel, Slot, Wish, next_on_grid
from sdrlinkd.link.access.sightings import Sightings
from sdrlinkd.link.access.steps import after
from sdrlinkd.link.access.tdma_states import STEPS, Happens, State
from sdrlinkd.link.traits import Sensed
from sdrlinkd.wire import Frame

LISTEN_S = 2.5
"""Who hears no schedule for so long, and a second more for each robot before it, begins one."""
QUIET_S = 0.05
"""The lowest robot begins one when it has heard nobody for so long, and a frame at least."""
FORGET_S = 3.0
"""A schedule not heard of for so long has lost its root; for twice as long, it is believed only
from those as near to it as we were."""
LISTEN_SHARE = 0.25
"""Of its own slots, while nobody follows it: others may have theirs at the same time."""
MAX_LEVEL = 255
PAUSE_AFTER = 2 / 3
UNSCHEDULED = 3
"""After so many beacons without a schedule, a robot has none."""


class Tdma(BusyChannel):
    """Slots in the order of `nodes`, over and over; the last `guard_s` of each is silent.

    No burst goes on over two thirds of a slot: an urgent message that comes while its robot has the
    slot need not wait for the next.

    The schedule is that of the lowest robot heard of, directly or through others (its root); each
    tells it on with its own count of hops (level). With `reuse`, a slot whose owner is silent, or
    silent again, is open to the others in order, one `minislot_s` after another; but not to who
    knows of a robot it does not hear: that one may well be sending.

    Robots that kept schedules of their own out of each other's reach may come back with slots at
    the same time, and as long as all send in all of theirs, nobody hears anybody. A root that has
    had no follower for FORGET_S listens through some of its slots, by chance, and goes where the
    others are.
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
        self._slot_s = slot_s
        self._guard_s = guard_s
        self._minislot_s = minislot_s
        self._reuse = reuse
        self._rng = rng
        self._look_s = look_s
        self._detect_s = detect_s
        self._gap_s = gap_s
        self.round_s = self._frame_s = slot_s * len(nodes)
        self.share = (slot_s - guard_s) / self._frame_s
        # With reuse, others may have begun.
        self.step_s = reuse * minislot_s * len(nodes)
        # Micro-seconds are what travels.
        times = (round(1e6 * slot_s), round(1e6 * guard_s), round(1e6 * minislot_s) * reuse)
        self._times_crc = crc_hqx(pack(">III", *times) + bytes(nodes), 0)
        self._origin = 0.0
        self._root, self._level, self._parent = own_id, 0, own_id
        self._lost = (-1, 0, 0.0)
        """(root, level at which we followed it, until when it is not believed)."""
        self.role = State.LISTENING
        """Whose schedule is kept."""
        self._told_at = 0.0
        self._begins_at = LISTEN_S + sum(node < own_id for node in nodes)
        self._strangers = Sightings()
        """Schedules that are not ours."""
        self._unscheduled = Sightings()
        """Beacons since a robot told of a schedule: who has one tells it beside each."""
        self._heard_at: dict[int, float] = {}
        self._followed_at = 0.0
        self._listens = (-inf, False)
        """Of our latest slot: its begin, and whether we listen through it."""
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
            f"tdma: {len(self._nodes)} slots of {self._slot_s * 1e3:.3g} ms, guard "
            f"{self._guard_s * 1e3:.3g} ms; {doing}"
        )

    def carries(self, burst_s: float) -> float:
        """The share of the air that bursts take of slots less guards and gaps."""
        open_s = self._slot_s - self._guard_s
        return open_s / self._slot_s * burst_s / (burst_s + self._gap_s)

    def slot(self, wish: Wish) -> Slot | None:
        """In our own slot, or in one that nobody uses."""
        earliest, _, need_s, sensed = wish
        if self.role is State.LISTENING:
            if earliest < self._begins_at and not self._is_first(earliest, sensed):
                return None
            self._go(Happens.BEGINS)
            self._origin = self._followed_at = earliest
        self._forget(earliest)
        number = math.floor((earliest - self._origin) / self._slot_s)
        for each in (number, number + 1):
            begin = self._origin + each * self._slot_s
            end = begin + self._slot_s - self._guard_s
            turn = (self._rank - each) % len(self._nodes)
            if turn == 0 and self._listens_through(begin, earliest):
                continue
            start = self._start(begin, turn, earliest, sensed)
            if start is not None and start + need_s <= end:
                if start >= earliest + self._look_s:
                    # Decided at the last look before.
                    return None
                pause = begin + PAUSE_AFTER * (self._slot_s - self._guard_s)
                planned_end = pause if start + need_s <= pause else end
                if self._reuse:
                    # The others count on it.
                    return Slot.exact(start, planned_end)
                return Slot(start, planned_end, end)
        return None

    def heard(self, src: int, at: float, is_relayed: bool) -> None:
        """Note that robot `src` is not hidden from us."""
        if not is_relayed:
            self._heard_at[src] = at

    def told_of(self, node: int, at: float) -> None:
        """Note that robot `node` is there, whether we hear it or not."""
        if node != self._own_id:
            self._told_of_at[node] = at

    def beacon(self, src: int, at: float) -> None:
        """Note a beacon of robot `src`: a schedule should come with it."""
        self._unscheduled.add(src, at)

    def frame(self, start: float) -> Frame | None:
        """The schedule as we keep it, for a burst that leaves at `start`; None while listening."""
        if self.role is State.LISTENING:
            return None
        self._forget(start)
        phase_s = (start - self._origin) % self._frame_s
        return Frame(self._root, self._level, self._times_crc, round(1e6 * phase_s))

    def take_frame(self, src: int, frame: Frame, at: float) -> None:
        """Follow the lowest root, by the fewest hops."""
        self._unscheduled.clear(src)
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
            # They will follow us; until then we go on where they are.
            if self.role is State.LISTENING:
                self._go(Happens.ADOPTS)
                self._origin, self._followed_at = origin, at
            elif self._is_alone(at):
                self._go(Happens.ADOPTS)
                self._origin = origin
        elif frame.root == self._lost[0] and told[1] > self._lost[1] and at < self._lost[2]:
            # Somebody who has not forgotten it yet.
            return
        elif frame.level < MAX_LEVEL and (
            src == self._parent or told < (self._root, self._level) or self.role is State.LISTENING
        ):
            self._go(Happens.FOLLOWS)
            self._root, self._level, self._parent = *told, src
            self._origin, self._told_at = origin, at

    def notices(self, now: float) -> list[str]:
        """Robots that keep another schedule, or none, in sentences."""
        return [
            f"robot {src} keeps no tdma schedule: its bursts fall into other robots' slots; give "
            "it the same [access], and a radio of the same kind where access.policy is auto"
            for src in self._unscheduled.lately(now, UNSCHEDULED)
        ] + [
            f"robot {src} keeps a different tdma schedule; give both the same nodes, slot_s, "
            f"guard_s and minislot_s in [access] (ours: {self.state})"
            for src in self._strangers.lately(now)
        ]

    def _go(self, happens: Happens) -> None:
        self.role = after(STEPS, self.role, happens)

    def _is_first(self, earliest: float, sensed: Sensed) -> bool:
        """Whether we are the lowest, and nobody seems to be there."""
        lowest = self._own_id == min(self._nodes)
        return lowest and earliest >= max(QUIET_S, self._frame_s) and sensed.idle_since <= 0

    def _forget(self, now: float) -> None:
        """Go on by our own clock where nobody has heard our root for long."""
        if self.role is State.FOLLOWER and now - self._told_at > FORGET_S:
            self._go(Happens.LOSES)
            self._lost = (self._root, self._level, now + 2 * FORGET_S)
            self._root, self._level, self._parent = self._own_id, 0, self._own_id
            self._followed_at = now

    def _is_alone(self, now: float) -> bool:
        """Whether nobody keeps our schedule, nor we another's; a root is given some time."""
        is_root = self.role is not State.FOLLOWER
        return is_root and now - self._followed_at >= FORGET_S

    def _listens_through(self, begin: float, now: float) -> bool:
        """Whether our slot that begins then stays empty, to hear who else sends in it."""
        if len(self._nodes) == 1 or not self._is_alone(now):
            return False
        if abs(begin - self._listens[0]) > self._slot_s / 2:
            self._listens = (begin, self._rng.random() < LISTEN_SHARE)
        return self._listens[1]

    def _knows_of_hidden(self, now: float) -> bool:
        """Whether others hear somebody whom we do not."""
        return any(
            now - told_at < FORGET_S and now - self._heard_at.get(node, -inf) >= FORGET_S
            for node, told_at in self._told_of_at.items()
        )

    def _start(self, begin: float, turn: int, earliest: float, sensed: Sensed) -> float | None:
        """Where we may begin in the slot that begins at `begin`, `turn` robots after its owner."""
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
            first = begin + turn * self._minislot_s
        else:
            first = idle_since + (turn + 1) * self._minislot_s
        start = next_on_grid(first, n * self._minislot_s, earliest)
        return start if start <= sensed.until + self._minislot_s - self._detect_s else None
