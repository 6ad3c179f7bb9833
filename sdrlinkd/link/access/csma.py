"""`csma`: listen before talk, p-persistent.

Stations that wait for the same busy channel would all start when it falls idle. So each waits for
DWAIT, then for the slots of its class, and then for a random number of further slots. That number
has the geometric distribution that a trial with PERSIST in every idle slot gives. The draw is kept
while the channel stays idle, since a new draw at every query would favor stations that query more
often. It becomes void when the channel was busy, the class changes, or the start has passed.
"""

import math
from collections.abc import Mapping
from enum import Enum, auto
from random import Random

from sdrlinkd.link.access.base import NEVER, BusyChannel, Slot, Wish, next_on_grid
from sdrlinkd.link.access.steps import after
from sdrlinkd.link.qos import Qos

# By class: slots to wait on an idle channel, and the factor on PERSIST.
WINDOWS = {
    Qos.URGENT: (0, 8.0),
    Qos.LATENCY: (1, 4.0),
    Qos.DEFAULT: (2, 1.0),
    Qos.BULK: (3, 0.5),
}


MOST_SLOTS = 1000
"""Slots after which a chance to begin counts as none."""


class State(Enum):
    """State of the backoff: whether a start has been drawn for the next burst."""

    OPEN = auto()
    DRAWN = auto()


class Happens(Enum):
    """Events that change the backoff state."""

    DRAWS = auto()
    """A start is drawn and replaces a void one."""
    BEGINS = auto()
    """The burst begins at its start."""


STEPS: Mapping[tuple[State, Happens], State] = {
    (State.OPEN, Happens.DRAWS): State.DRAWN,
    (State.DRAWN, Happens.DRAWS): State.DRAWN,
    (State.DRAWN, Happens.BEGINS): State.OPEN,
}


class Csma(BusyChannel):
    """p-persistent CSMA: on an idle channel wait for DWAIT and for the slots of the class, then
    send in each SLOTTIME with probability PERSIST.

    Two stations that choose the same slot collide, and neither of them notices.
    """

    others_follow = True

    def __init__(
        self,
        dwait_s: float,
        slottime_s: float,
        persist: float,
        detect_s: float,
        rng: Random,
        robots: int = 2,
    ) -> None:
        super().__init__()
        self._robots = robots
        self.pause_s = self._dwait_s = dwait_s
        self.slottime_s = slottime_s
        self._persist = persist
        self._detect_s = detect_s
        self._rng = rng
        self.backoff = State.OPEN
        """Whether a start has been drawn."""
        self._drawn = (NEVER, Qos.BULK, NEVER)
        """The drawn start as (time since which the channel is idle, class, start)."""
        self._backoffs = 0

    @property
    def state(self) -> str:
        """Policy, times and backoffs so far, for people."""
        return (
            f"csma: DWAIT {self._dwait_s * 1e3:.3g} ms, SLOTTIME {self.slottime_s * 1e3:.3g} ms, "
            f"PERSIST {self._persist:g}; {self._backoffs} backoffs"
        )

    def mean_wait_s(self, qos: Qos) -> float:
        """Mean wait in s: DWAIT, the slots of the class, and the mean of the random slots."""
        waits, eagerness = WINDOWS[qos]
        passed = 1 / min(1.0, eagerness * self._persist) - 1
        return self._dwait_s + (waits + passed) * self.slottime_s

    def carries(self, burst_s: float) -> float:
        """Share of airtime of bursts that do not collide, less the slots that pass idle."""
        waits, eagerness = WINDOWS[Qos.DEFAULT]
        chance, n = min(1.0, eagerness * self._persist), self._robots
        anybody = 1 - (1 - chance) ** n
        nobody_else = n * chance * (1 - chance) ** (n - 1) / anybody
        idle_s = self._dwait_s + (waits + 1 / anybody - 1) * self.slottime_s
        return nobody_else * burst_s / (burst_s + idle_s)

    def begins_first(self, qos: Qos, others: Qos, n: int) -> float:
        """Chance that class `qos` begins before `n` robots with a class `others` after a burst."""
        (own_waits, own), (their_waits, theirs) = WINDOWS[qos], WINDOWS[others]
        chance, later = min(1.0, own * self._persist), 1 - min(1.0, theirs * self._persist)
        found, nobody = 0.0, 1.0
        for slot in range(own_waits, own_waits + MOST_SLOTS):
            nobody_else = later ** (n * max(0, slot - their_waits + 1))
            found += nobody * chance * nobody_else
            nobody *= 1 - chance
        return found

    def slot(self, wish: Wish) -> Slot | None:
        """The drawn slot, once all slots before it were sensed idle."""
        earliest, qos, sensed = wish.earliest, wish.qos, wish.sensed
        idle_since = self.idle_since(sensed)
        if idle_since is None:
            return None
        *of, start = self._drawn
        if self.backoff is State.OPEN or of != [idle_since, qos] or start < earliest:
            start = self._draw(idle_since, earliest, qos)
            self.backoff = after(STEPS, self.backoff, Happens.DRAWS)
            self._drawn = (idle_since, qos, start)
        if start > sensed.until + self.slottime_s - self._detect_s:
            return None
        self.backoff = after(STEPS, self.backoff, Happens.BEGINS)
        return Slot.exact(start)

    def _draw(self, idle_since: float, earliest: float, qos: Qos) -> float:
        waits, eagerness = WINDOWS[qos]
        first = next_on_grid(
            idle_since + self._dwait_s + waits * self.slottime_s, self.slottime_s, earliest
        )
        chance = min(1.0, eagerness * self._persist)
        passed = 0
        if chance < 1:
            passed = int(math.log(1 - self._rng.random()) / math.log(1 - chance))
        self._backoffs += passed > 0
        return first + passed * self.slottime_s
