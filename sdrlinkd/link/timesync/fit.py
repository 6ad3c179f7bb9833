"""The lines that are possible between the samples of two directions, and how likely they are.

Geometry: over local time x, each sample of one direction is a point above the line of the true
offset, and each sample of the other a point below it. The line has a slope, the skew, of at most
MOST. Every line between the two clouds is possible. For a given slope, the highest and the lowest
possible line each touch a cloud. Among slopes, a line is more likely the closer the samples are to
it. If delays beyond their smallest value are exponential, the likelihood of a slope is the product
of 1/(mean excess)^n over both directions (`weights`), times a prior for crystals.

The line is the tangent of the true offset at `now`. If the frequency moves by at most `wander`, the
true offset bends away from it by at most wander × age² / 2. Each sample is relaxed by that much.
"""

import math

import numpy as np
from numpy.typing import NDArray

from sdrlinkd.link.timesync.side import Side

PRIOR_PPM = 30.0
"""Typical difference of two ordinary clocks, in ppm."""
MOST = 1.2e-3
"""Largest difference of two clocks' rates, in s per s."""
NEGLIGIBLE = 3e-4
"""Likelihood of a slope, relative to the most likely one, below which it is ignored."""
GRID = 33

Slopes = NDArray[np.float64]


class Lines:
    """The lines between the samples above and those below, if the frequency moves by `wander`.

    `now` in s is where offsets are told; `wander` is in 1/s; older samples than `oldest_s` are left
    out.
    """

    def __init__(
        self, above: Side, below: Side, now: float, wander: float, oldest_s: float = math.inf
    ) -> None:
        sides = [side.lowest(MOST, now, wander, oldest_s) for side in (above, below)]
        self._x = [x - now for x, _ in sides]
        self._v = [v for _, v in sides]

    @property
    def is_known(self) -> bool:
        """Whether there are samples of both directions."""
        return all(map(len, self._x))

    def bounds(self, slopes: Slopes) -> tuple[Slopes, Slopes]:
        """(upper bounds, negated lower bounds) of the offset now, for each slope."""
        above = (self._v[0] - slopes[:, None] * self._x[0]).min(axis=1)
        below = (self._v[1] + slopes[:, None] * self._x[1]).min(axis=1)
        return above, below

    def gaps(self, slopes: Slopes) -> Slopes:
        """Distance of the highest and the lowest line in s, for each slope; negative: none fits."""
        above, below = self.bounds(slopes)
        return above + below

    def widest(self) -> tuple[float, float, float]:
        """(slope of the largest gap, that gap in s, error of that slope)."""
        low, high = -MOST, MOST
        for _ in range(4):
            slopes = np.linspace(low, high, GRID)
            gaps_s = self.gaps(slopes)
            best = int(np.argmax(gaps_s))
            low, high = slopes[max(0, best - 1)], slopes[min(GRID - 1, best + 1)]
        return float(slopes[best]), float(gaps_s[best]), float(high - low)

    def possible(self, inner: float, step: float, least_s: float) -> tuple[float, float]:
        """(lowest, highest) slope around `inner` with a gap of at least `least_s`, outwards.

        `step` is the least distance from `inner` that is looked at.
        """
        n = math.ceil(math.log2(2 * MOST / step)) + 1
        steps = step * 2.0 ** np.arange(n)
        outer = np.concatenate((np.maximum(inner - steps, -MOST), np.minimum(inner + steps, MOST)))
        fits = self.gaps(outer) >= least_s
        spans = [
            _crossing(inner, side, each)
            for side, each in ((outer[:n], fits[:n]), (outer[n:], fits[n:]))
        ]
        finer = np.concatenate([np.linspace(*span, GRID) for span in spans])
        fits = self.gaps(finer) >= least_s
        lowest, highest = (
            _last(side, each)
            for side, each in ((finer[:GRID], fits[:GRID]), (finer[GRID:], fits[GRID:]))
        )
        return lowest, highest


def _crossing(inner: float, outer: Slopes, fits: NDArray[np.bool_]) -> tuple[float, float]:
    """The last slope that fits and the next one; `outer` lists slopes at growing distance."""
    if fits.all():
        return float(outer[-1]), float(outer[-1])
    first_not = int(np.argmin(fits))
    return float(outer[first_not - 1]) if first_not else inner, float(outer[first_not])


def _last(slopes: Slopes, fits: NDArray[np.bool_]) -> float:
    """The first slope that does not fit, which is rounded outwards; or the last one."""
    return float(slopes[-1] if fits.all() else slopes[int(np.argmin(fits))])


class Fit:
    """The most likely line; likelihoods assume exponential delays, and clocks 30 ppm apart."""

    def __init__(
        self, above: Side, below: Side, now: float, resolution_s: float, wander: float
    ) -> None:
        self._resolution_s = resolution_s
        self._lines = Lines(above, below, now, wander)
        self._totals = [(n, x - now, v) for n, x, v in (above.totals(), below.totals())]
        self.best, self.gap_s, self.step = self._lines.widest()
        """Slope with the largest gap, that gap in s, and the error of that slope."""

    def line(self) -> tuple[float, float]:
        """(offset now in s, skew): the means over all likely slopes."""
        lowest, highest = self._lines.possible(self.best, self.step, 0.0)
        slopes = np.linspace(lowest, highest, GRID)
        likely = np.flatnonzero(self._weights(slopes) > NEGLIGIBLE)
        first, last = max(0, likely[0] - 1), min(GRID - 1, likely[-1] + 1)
        slopes = np.linspace(slopes[first], slopes[last], 2 * GRID)
        weights = self._weights(slopes)
        weights /= weights.sum()
        above, below = self._lines.bounds(slopes)
        return float((above - below) @ weights / 2), float(slopes @ weights)

    def _weights(self, slopes: Slopes) -> Slopes:
        """Likelihood of each slope relative to the most likely one."""
        above, below = self._lines.bounds(slopes)
        (n_above, x_above, v_above), (n_below, x_below, v_below) = self._totals
        # Each bucket keeps its lowest sample for one slope, which may not be lowest for others.
        excess = np.maximum(v_above - slopes * x_above - above, 0.0) + self._resolution_s
        lack = np.maximum(v_below + slopes * x_below - below, 0.0) + self._resolution_s
        # The constant keeps crystals with a large error possible, though unlikely.
        unusual = -np.log(np.exp(-((1e6 * slopes / PRIOR_PPM) ** 2) / 2) + 1e-6)
        costs = n_above * np.log(excess) + n_below * np.log(lack) + unusual
        weights: Slopes = np.exp(costs.min() - costs)
        return weights
