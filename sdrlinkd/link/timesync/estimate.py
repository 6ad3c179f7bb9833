"""What is known about a clock: its offset, its rate, and how far both may be off."""

from typing import NamedTuple


class Estimate(NamedTuple):
    """Local minus remote time at local time `at`: `offset_s`, with an error of at most `bound_s`.

    `skew` is the growth of the offset in s per s, with an error of at most `skew_bound`. It changes
    by at most `wander` per s.
    """

    at: float
    offset_s: float
    skew: float
    bound_s: float
    skew_bound: float
    wander: float = 0.0

    def offset(self, now: float) -> float:
        """The offset in s, extrapolated to `now`."""
        return self.offset_s + self.skew * (now - self.at)

    def bound(self, now: float) -> float:
        """Largest error of the offset at `now`, in s."""
        age_s = max(0.0, now - self.at)
        return self.bound_s + self.skew_bound * age_s + 0.5 * self.wander * age_s**2

    def early_s(self, x: float, v: float, sign: float) -> float:
        """By how much the delay of a sample is too short, in s; at most 0: it may be true.

        `sign`: 1.0 for a sample above the line, -1.0 for one below. `x`, `v`: as in `Side`.
        """
        return sign * self.offset(x) - self.bound(x) - v

    def delay_s(self, x: float, v: float, sign: float) -> float:
        """Most likely delay of a sample, in s."""
        return v - sign * self.offset(x)
