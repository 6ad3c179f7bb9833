"""Estimates the offset of two clocks from the shortest delays of each direction.

No delay is negative, so a burst from the other robot bounds the offset from above, and its report
about our burst bounds it from below. The shortest delays of the two directions need not belong
together, so with N messages each way the error falls as 1/N; a filter over round trips gains only
1/√N. Delays are counted beyond the airtime, which both robots know.

Geometry: over local time x, each sample of one direction is a point above the line of the true
offset, and each sample of the other a point below it. Clocks drift, so the line has a slope, the
skew, of at most MOST. Every line between the two clouds is possible. For a given slope, the highest
and the lowest possible line each touch a cloud. Their mean is the best estimate and half their
distance is the bound, because delays are positive and their smallest values are unknown
(`_bounds`). Among slopes, a line is more likely the closer the samples are to it. If delays beyond
their smallest value are exponential, the likelihood of a slope is the product of 1/(mean excess)^n
over both directions (`_weights`), times a prior for crystals. The offset is the mean over slopes
with these weights; its bound covers every possible line, however unlikely.
"""

from collections import deque
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sdrlinkd.link.timesync.side import Side

WINDOW_S = 60.0
PRIOR_PPM = 30.0
"""Typical difference of two ordinary clocks, in ppm."""
MOST = 1.2e-3
"""Largest difference of two clocks' rates, in s per s."""
MISS_S = 5e-4
"""Margin in s by which a sample must violate the bound to count as contradicting the others."""
RUNNING, AMONG = 3, 8
"""A clock was stepped if RUNNING of the last AMONG samples of a direction contradict the others.
With fewer, they are bad stamps, unless the rule of PAIR applies."""
PAIR, LATELY, OPPOSITE = 2, 25, 4
"""A clock was also stepped if PAIR of the last LATELY samples contradict, and at least OPPOSITE
samples of the other direction came meanwhile, all of them late by at least as much."""
FLOOR_SHARE = 0.05
"""Share of the airtime of both directions by which delays may come out shorter than the airtime."""
NEGLIGIBLE = 3e-4
"""Likelihood of a slope, relative to the most likely one, below which it is ignored."""
GRID = 33

_Slopes = NDArray[np.float64]


class Estimate(NamedTuple):
    """Local minus remote time at local time `at`: `offset_s`, with an error of at most `bound_s`.

    `skew` is the growth of the offset in s per s, with an error of at most `skew_bound`.
    """

    at: float
    offset_s: float
    skew: float
    bound_s: float
    skew_bound: float

    def offset(self, now: float) -> float:
        """The offset in s, extrapolated to `now`."""
        return self.offset_s + self.skew * (now - self.at)

    def bound(self, now: float) -> float:
        """Largest error of the offset at `now`, in s."""
        return self.bound_s + self.skew_bound * max(0.0, now - self.at)


class DualEnvelope:
    """Estimates the offset of two robots' clocks; all times are in s.

    `resolution_s` is the resolution of the time stamps. A sample that contradicts the others is
    held back until it is clear which of them are wrong.
    """

    def __init__(self, resolution_s: float = 2e-5) -> None:
        self._resolution_s = resolution_s
        self._above, self._below = Side(WINDOW_S), Side(WINDOW_S)
        self._airtime_s = [0.0, 0.0]
        self._running: dict[Side, deque[tuple[float, float] | None]] = {
            side: deque(maxlen=LATELY) for side in (self._above, self._below)
        }
        self.estimate: Estimate | None = None
        self.samples = 0
        self.steps = 0
        """How often a clock was seen to jump."""
        self.contradicted = 0
        """Time stamps rejected because they contradict the others."""
        self.narrowed = 0
        """How often older samples were dropped because delays came out shorter than the airtime."""

    def heard(self, sent_there: float, came_here: float, airtime_s: float) -> None:
        """Take a burst of the other robot: sent at its time, heard at ours."""
        self._airtime_s[0] = airtime_s
        self._note(self._above, self._below, came_here, came_here - sent_there - airtime_s, 1.0)

    def was_heard(self, sent_here: float, came_there: float, airtime_s: float) -> None:
        """Take a burst of ours: sent at our time, heard at the other robot's."""
        self._airtime_s[1] = airtime_s
        self._note(self._below, self._above, sent_here, came_there - sent_here - airtime_s, -1.0)

    def solve(self, now: float) -> Estimate | None:
        """The estimate at `now` from all samples; None while a direction has none."""
        for side in (self._above, self._below):
            side.forget_before(now - WINDOW_S)
        least_gap_s = -FLOOR_SHARE * sum(self._airtime_s) - 2 * self._resolution_s
        while self._above and self._below:
            fit = _Fit(self._above, self._below, now, self._resolution_s)
            if fit.gap_s >= least_gap_s:
                self.estimate = fit.estimate()
                return self.estimate
            self.narrowed += 1
            self._drop_older_half()
        self.estimate = None
        return None

    def forget(self) -> None:
        """Forget all samples, as the other robot has a new clock."""
        for side, running in self._running.items():
            side.clear()
            running.clear()
        self.estimate = None

    def _note(self, side: Side, other: Side, x: float, v: float, sign: float) -> None:
        self.samples += 1
        known, running = self.estimate, self._running[side]
        slope = 0.0 if known is None else sign * known.skew
        contradicts = known is not None and v < sign * known.offset(x) - known.bound(x) - MISS_S
        running.append((x, v) if contradicts else None)
        self.contradicted += contradicts
        if not contradicts:
            side.add(x, v, slope)
        if known is not None and self._was_stepped(side, other, known, sign):
            self._restart(side, other, slope)

    def _was_stepped(self, side: Side, other: Side, known: Estimate, sign: float) -> bool:
        running = list(self._running[side])
        held = [each for each in running if each is not None]
        if len(held) < PAIR:
            return False
        if len(running[-AMONG:]) - running[-AMONG:].count(None) >= RUNNING:
            return True
        misses_s = [sign * known.offset(x) - known.bound(x) - v for x, v in held]
        since = other.x >= held[0][0]
        late_s = other.v[since] + sign * known.offset(known.at) + known.bound_s
        late_s += sign * known.skew * (other.x[since] - known.at)
        return len(late_s) >= OPPOSITE and bool(late_s.min() >= max(misses_s))

    def _restart(self, side: Side, other: Side, slope: float) -> None:
        """Start over with the contradicting samples, and those of the other direction since."""
        contradicting = [each for each in self._running[side] if each is not None]
        for running in self._running.values():
            running.clear()
        side.clear()
        other.forget_before(contradicting[0][0])
        for x, v in contradicting:
            side.add(x, v, slope)
        self.contradicted -= len(contradicting)
        self.steps += 1
        self.estimate = None

    def _drop_older_half(self) -> None:
        times = np.concatenate((self._above.x, self._below.x))
        middle = np.nextafter(float(np.median(times)), np.inf)
        for side in (self._above, self._below):
            side.forget_before(middle)


class _Fit:
    """Fits a common slope to both envelopes.

    A slope is possible if no delay becomes negative. Likelihoods assume that delays are exponential
    and that clocks differ by about 30 ppm.
    """

    def __init__(self, above: Side, below: Side, now: float, resolution_s: float) -> None:
        self._now = now
        self._resolution_s = resolution_s
        (x_above, v_above), (x_below, v_below) = above.lowest(MOST), below.lowest(MOST)
        self._x, self._v = (x_above - now, x_below - now), (v_above, v_below)
        self._totals = [(n, x - now, v) for n, x, v in (above.totals(), below.totals())]
        low, high = -MOST, MOST
        for _ in range(4):
            slopes = np.linspace(low, high, GRID)
            gaps_s = self._gaps(slopes)
            best = int(np.argmax(gaps_s))
            low, high = slopes[max(0, best - 1)], slopes[min(GRID - 1, best + 1)]
        self.gap_s = float(gaps_s[best])
        """Largest gap between the two envelopes over all slopes, in s."""
        steps = (high - low) * 2.0 ** np.arange(26)
        self._lowest = self._last_possible(slopes[best], np.maximum(slopes[best] - steps, -MOST))
        self._highest = self._last_possible(slopes[best], np.minimum(slopes[best] + steps, MOST))

    def estimate(self) -> Estimate:
        """The estimate: means over all likely slopes, bounds over all possible ones."""
        slopes = np.linspace(self._lowest, self._highest, GRID)
        likely = np.flatnonzero(self._weights(slopes) > NEGLIGIBLE)
        first, last = max(0, likely[0] - 1), min(GRID - 1, likely[-1] + 1)
        slopes = np.linspace(slopes[first], slopes[last], 2 * GRID)
        weights = self._weights(slopes)
        weights /= weights.sum()
        above, below = self._bounds(slopes)
        offset_s = float((above - below) @ weights / 2)
        skew = float(slopes @ weights)
        # All samples are in the past, so the offset at `now` grows with the slope for both bounds.
        least_s = -float(self._bounds(np.array([self._lowest]))[1][0])
        most_s = float(self._bounds(np.array([self._highest]))[0][0])
        return Estimate(
            self._now,
            offset_s,
            skew,
            max(most_s - offset_s, offset_s - least_s, 0.0) + self._resolution_s,
            max(self._highest - skew, skew - self._lowest),
        )

    def _bounds(self, slopes: _Slopes) -> tuple[_Slopes, _Slopes]:
        """(upper bounds, negated lower bounds) of the offset now, for each slope."""
        above = (self._v[0] - slopes[:, None] * self._x[0]).min(axis=1)
        below = (self._v[1] + slopes[:, None] * self._x[1]).min(axis=1)
        return above, below

    def _gaps(self, slopes: _Slopes) -> _Slopes:
        above, below = self._bounds(slopes)
        return above + below

    def _weights(self, slopes: _Slopes) -> _Slopes:
        """Likelihood of each slope relative to the most likely one."""
        above, below = self._bounds(slopes)
        (n_above, x_above, v_above), (n_below, x_below, v_below) = self._totals
        # Each bucket keeps its lowest sample for one slope, which may not be lowest for others.
        excess = np.maximum(v_above - slopes * x_above - above, 0.0) + self._resolution_s
        lack = np.maximum(v_below + slopes * x_below - below, 0.0) + self._resolution_s
        # The constant keeps crystals with a large error possible, though unlikely.
        unusual = -np.log(np.exp(-((1e6 * slopes / PRIOR_PPM) ** 2) / 2) + 1e-6)
        costs = n_above * np.log(excess) + n_below * np.log(lack) + unusual
        weights: _Slopes = np.exp(costs.min() - costs)
        return weights

    def _last_possible(self, inner: float, outer: _Slopes) -> float:
        """The farthest slope from `inner` for which no delay is negative, rounded outwards.

        `outer` lists slopes at increasing distance.
        """
        possible = self._gaps(outer) >= 0
        if possible.all():
            return float(outer[-1])
        first_not = int(np.argmin(possible))
        slopes = np.linspace(outer[first_not - 1] if first_not else inner, outer[first_not], GRID)
        return float(slopes[int(np.argmin(self._gaps(slopes) >= 0))])
