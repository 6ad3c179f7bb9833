"""Turns that anybody may use who has none."""

from math import inf
from random import Random


class OpenTurns:
    """Decides once for each such turn whether we send in it."""

    def __init__(self, rng: Random) -> None:
        self._rng = rng
        self._tried = -inf, False
        """The last turn, as (its begin, whether we use it)."""

    def tries(self, begin: float, n: int) -> bool:
        """Whether to send in the turn at `begin`: at random, as `n` robots may do so."""
        if self._tried[0] != begin:
            self._tried = begin, self._rng.random() * n < 1
        return self._tried[1]
