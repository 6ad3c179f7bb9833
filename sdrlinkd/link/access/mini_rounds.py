"""The mini-slots after a burst: rounds that follow each other until somebody sends.

A round has a mini-slot for a challenge, and one for a burst. After a challenge, it has those of the
contest and one for the burst of its winner.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from sdrlinkd.link.access.base import NEVER
from sdrlinkd.link.access.own_slots import DRIFT, ROUNDING_S

QUIET = 2
"""Mini-slots of a round without a challenge."""


class Place(NamedTuple):
    """A mini-slot: the `number`-th of the round that begins at `begin`, in s."""

    idle_since: float
    begin: float
    width_s: float
    number: int
    n_before: int
    """Rounds before this one since the last burst."""
    is_contested: bool
    fruitless: int
    """Rounds with pulses and without a burst that have passed since the last known one."""

    @property
    def start(self) -> float:
        return self.at(self.number)

    def at(self, number: int) -> float:
        """The start of another mini-slot of the round."""
        return self.begin + number * self.width_s

    @property
    def is_first(self) -> bool:
        """Whether the round is the first one after a burst."""
        return not self.n_before


class MiniRounds:
    """Rounds of mini-slots of `minislot_s`, which grow with the time of silence, as clocks drift.

    `n_bits` is the number of mini-slots of a contest.
    """

    def __init__(self, minislot_s: float, n_bits: int) -> None:
        self._minislot_s = minislot_s
        self._n_bits = n_bits
        self._known = (NEVER, 0.0, 0)
        """The current round: time since which the channel is idle, begin after that in s, and count
        of rounds before it."""
        self._is_quiet = False
        """Whether the round, the first one after a burst, is without a challenge so far."""

    def knows(self, idle_since: float) -> bool:
        """Whether a mini-slot since then has been looked at."""
        return self._known[0] == idle_since

    def place(self, idle_since: float, earliest: float, pulses: Sequence[float]) -> Place:
        """The first mini-slot that begins at `earliest` or later."""
        is_known = self._known[0] == idle_since
        begin, n_before = self._known[1:] if is_known else (self._minislot_s, 0)
        fruitless = 0
        while True:
            width_s = self._minislot_s + 2 * DRIFT * begin
            at = idle_since + begin
            is_contested = is_near(at, width_s, pulses)
            number = max(0, math.ceil((earliest - ROUNDING_S - at) / width_s))
            n = QUIET + self._n_bits * is_contested
            if number < n:
                break
            begin += n * width_s
            n_before += 1
            fruitless += is_contested
        return Place(idle_since, at, width_s, number, n_before, is_contested, fruitless)

    def go_on(self, place: Place, idle_since: float) -> bool:
        """Note that all is known before a mini-slot.

        Returns whether the first round has just passed, without a challenge and without a burst.
        """
        has_passed = self._is_quiet and not place.is_first and self._known[0] == idle_since
        self._is_quiet = place.is_first and not place.is_contested
        self._known = (idle_since, place.begin - idle_since, place.n_before)
        return has_passed and not place.fruitless


def is_near(start: float, width_s: float, pulses: Sequence[float]) -> bool:
    """Whether a pulse came in the mini-slot that begins at `start`."""
    # A loop, as this is asked often.
    half_s = width_s / 2
    for each in pulses:  # noqa: SIM110
        if abs(each - start) < half_s:
            return True
    return False
