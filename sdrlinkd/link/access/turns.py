"""Rounds of turns: who may send when, as the records GRANT tell it (wire document, 6.19)."""

import math
from collections.abc import Iterable
from typing import NamedTuple

from sdrlinkd.wire import ANYBODY

ALMOST_S = 1e-9
"""Rounding of times, in s."""


class Turn(NamedTuple):
    """The air belongs to robot `node` from `begin` to `end`, in s.

    ANYBODY stands for those without a turn.
    """

    node: int
    begin: float
    end: float


class Round(NamedTuple):
    """A round of turns, up to the next turn of the robot that planned it."""

    number: int
    begin: float
    turns: tuple[Turn, ...]
    end: float
    """When the next round may be told; after the last turn, and a guard time."""

    def is_sound(self, now: float, most_s: float) -> bool:
        """Whether the round can be meant: it begins near `now`, and is at most `most_s` long."""
        is_near = abs(self.begin - now) < most_s and self.end < self.begin + most_s
        return is_near and all(turn.begin >= self.begin for turn in self.turns)

    def until(self, end: float) -> "Round":
        """The round without turns that are not over at `end`."""
        return self._replace(turns=tuple(turn for turn in self.turns if turn.end <= end))

    def of(self, node: int) -> list[Turn]:
        """The turns in which robot `node` may send."""
        own = [turn for turn in self.turns if turn.node == node]
        return own or [turn for turn in self.turns if turn.node == ANYBODY]


class Ticks(NamedTuple):
    """The unit of turns and the guard time after each, in s; the same at all robots."""

    tick_s: float
    guard_s: float

    @property
    def guards(self) -> int:
        """The guard time in ticks."""
        return round(self.guard_s / self.tick_s)

    def count(self, length_s: float) -> int:
        """How many ticks a turn of at least this length takes."""
        return max(1, math.ceil(length_s / self.tick_s - 1e-6))

    def round(self, number: int, begin: float, told: Iterable[tuple[int, int]]) -> Round:
        """The round that begins at `begin` with turns as told: (robot, ticks)."""
        turns, at, end = [], begin, begin
        for node, ticks in told:
            if not ticks:
                at -= node * self.tick_s
                continue
            turn = Turn(node, at, at + ticks * self.tick_s)
            turns.append(turn)
            at = turn.end + self.guard_s
            end = max(end, at)
        return Round(number, begin, tuple(turns), end)
