"""What was known before a clock was taken to have moved, in case it did not."""

from copy import deepcopy

from sdrlinkd.link.timesync.estimate import Estimate
from sdrlinkd.link.timesync.side import Side
from sdrlinkd.link.timesync.way import PAIR, RUNNING, Held, Way

Sample = tuple[float, float, float]
"""(sign of its direction, time, bound), as in `Way`."""
MOST_SINCE = 64
"""Number of samples after which a move counts as true in any case."""


class Before:
    """The samples before a move that `way` showed; all that come afterwards are kept, too.

    The move is false if PAIR samples of the other direction fit what was known before, with shorter
    delays than the move allows. It is true if RUNNING more samples of `way` contradict that first.
    """

    def __init__(self, ways: tuple[Way, Way], way: Way, known: Estimate, *, is_step: bool) -> None:
        self.sides: list[Side] = [deepcopy(each.side) for each in ways]
        self.known = known
        self.held: list[Held] = way.held
        self.is_step = is_step
        self.since: list[Sample] = []
        self._sign = way.sign
        self._least_s = min(each.early_s for each in self.held)
        self._fitting = self._contradicting = 0

    def note(self, sign: float, x: float, v: float) -> None:
        """Take a sample that came afterwards."""
        self.since.append((sign, x, v))
        is_early = self.known.early_s(x, v, sign) > 0
        if sign == self._sign:
            self._contradicting += is_early
        elif not is_early:
            self._fitting += self.known.delay_s(x, v, sign) < self._least_s

    @property
    def is_false(self) -> bool:
        """Whether the clock did not move, after all."""
        return self._fitting >= PAIR

    @property
    def is_settled(self) -> bool:
        """Whether it is certain enough that the clock did move."""
        return self._contradicting >= RUNNING or len(self.since) >= MOST_SINCE
