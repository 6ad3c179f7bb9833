"""Whether something else than robots of the team sends pulses."""

from math import inf

FRUITLESS = 2
"""Rounds with pulses and without a burst from which the pulses count as interference."""
DISTURBED_S = 1.0
"""Time in s for which pulses are not used after interference, if it comes again within this time.
First it is until the next burst, from which a robot that just came into range counts as well."""


class Disturbance:
    """Counts rounds with pulses after which nobody sent."""

    def __init__(self) -> None:
        self._fruitless = 0
        self._at, self._until = -inf, -inf
        self._is_first = False
        """Whether it lasts only until the next burst."""

    def lasts(self, now: float) -> bool:
        """Whether pulses are not used at `now`."""
        return now < self._until

    def count(self, fruitless: int, start: float) -> None:
        """Note rounds with pulses and without a burst before `start`."""
        self._fruitless += fruitless
        if self._fruitless >= FRUITLESS:
            self._is_first = start > self._at + DISTURBED_S
            self._at, self._fruitless = start, 0
            self._until = start + DISTURBED_S

    def burst(self) -> None:
        """Use pulses again after the first burst, as all robots count from its end."""
        self._fruitless = 0
        if self._is_first:
            self._until = -inf
