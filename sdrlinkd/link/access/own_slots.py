"""Mini-slots of one's own: each robot has some in every round, and rounds follow each other."""

from typing import NamedTuple

DRIFT = 4e-5
"""Drift of two 20 ppm clocks, in s per second since the channel fell idle."""
ROUNDING_S = 1e-9


class OwnSlot(NamedTuple):
    """A mini-slot that begins at `start` and is `width_s` long, of which `drift_s` is for drift.

    The same is left free before it.
    """

    start: float
    width_s: float
    drift_s: float

    def is_known(self, until: float, detect_s: float) -> bool:
        """Whether all mini-slots before it were listened to.

        `until`: time up to which the channel is known. What begins in a mini-slot is detected after
        `detect_s`.
        """
        return self.start <= until + self.width_s - self.drift_s - detect_s


class OwnSlots:
    """Rounds of `n` mini-slots of `minislot_s`, which grow with the time of silence."""

    def __init__(self, minislot_s: float, n: int) -> None:
        self._minislot_s = minislot_s
        self._n = n
        self._round = (-1.0, 0.0)
        """The current round, as (time since which the channel is idle, begin after that in s)."""

    def next(self, number: int, idle_since: float, earliest: float) -> OwnSlot:
        """The `number`-th mini-slot of a round that begins at `earliest` or later."""
        begin = self._round[1] if self._round[0] == idle_since else self._minislot_s
        while True:
            drift_s = DRIFT * begin
            width_s = self._minislot_s + 2 * drift_s
            start = idle_since + begin + number * width_s
            if start >= earliest - ROUNDING_S:
                break
            begin += self._n * width_s
        self._round = (idle_since, begin)
        return OwnSlot(start, width_s, drift_s)
