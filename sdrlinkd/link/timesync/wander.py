"""How fast the difference of two clocks' rates moves, learned from samples that fit no line."""

PPM_PER_MIN = 1e-6 / 60
ASSUMED = 2 * PPM_PER_MIN
"""Wander that the bound always allows for, in 1/s."""
FIRST, MOST = 0.5 * PPM_PER_MIN, 16 * PPM_PER_MIN
"""Least and largest wander that is learned, in 1/s. Crystals that warm up stay below the largest;
what moves faster is a jump."""
MARGIN = 2.0
"""The bound allows for MARGIN times what is learned, beside what cannot be seen. Samples show only
the least wander that explains them."""
HALF_LIFE_S = 60.0
"""Time in s after which half of what was learned is left: that of the window."""


class Wander:
    """The least wander that explains the samples, in 1/s; it fades.

    Wander that bends the line by less than the stamps' resolution cannot be seen. Over a window of
    L s, a parabola of curvature c strays by c L² / 8 from its chord, and stays within ± d around a
    line if that is at most 2 d.
    """

    def __init__(self, resolution_s: float, window_s: float) -> None:
        self._unseen = max(ASSUMED, 16 * resolution_s / window_s**2)
        self._learned = 0.0
        self._at = 0.0

    def learned(self, now: float) -> float:
        """The learned wander at `now`; 0: a straight line explains all."""
        left = self._learned * 0.5 ** (max(0.0, now - self._at) / HALF_LIFE_S)
        return left if left >= FIRST else 0.0

    def allowed(self, now: float) -> float:
        """The wander that the bound allows for at `now`."""
        return self._unseen + MARGIN * self.learned(now)

    def steps(self, now: float) -> list[float]:
        """Larger wanders to be tried at `now`, the least first."""
        last = self.learned(now)
        tried = []
        while last < MOST:
            last = min(max(FIRST, 2 * last), MOST)
            tried.append(last)
        return tried

    def learn(self, wander: float, now: float) -> None:
        """Take the least wander that explains the samples at `now`."""
        self._learned, self._at = wander, now
