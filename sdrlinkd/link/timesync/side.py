"""The samples of one direction with the shortest delays, over time."""

import math

import numpy as np
from numpy.typing import NDArray

BUCKET_S = 0.1
"""Length of a bucket in s, which keeps the sample with the shortest delay and the sum of all."""


class Side:
    """Upper bounds of a drifting offset, the oldest first, none older than `window_s`."""

    def __init__(self, window_s: float) -> None:
        self._window_s = window_s
        self._most = math.ceil(window_s / BUCKET_S) + 2
        # Twice the needed length, so that rows are rarely moved.
        self._rows = np.zeros((5, 2 * self._most))
        self._begin = self._end = 0
        self._bucket = -math.inf

    def __len__(self) -> int:
        return self._end - self._begin

    @property
    def x(self) -> NDArray[np.float64]:
        """Times of the samples in s."""
        return self._rows[0, self._begin : self._end]

    @property
    def v(self) -> NDArray[np.float64]:
        """Bounds that the samples give, in s."""
        return self._rows[1, self._begin : self._end]

    def lowest(
        self, steepest: float, now: float = 0.0, wander: float = 0.0, oldest_s: float = math.inf
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(times, bounds) of the samples that a line with a slope within ±`steepest` can touch.

        Each bound is relaxed by what a frequency that moves by `wander` per s can bend until `now`.
        Samples that are older than `oldest_s` by then are left out.
        """
        first = int(np.searchsorted(self.x, now - oldest_s))
        x = self.x[first:]
        v = self.v[first:] + 0.5 * wander * (x - now) ** 2
        later, earlier = v + steepest * x, v - steepest * x
        keep = later <= np.minimum.accumulate(later[::-1])[::-1]
        keep &= earlier <= np.minimum.accumulate(earlier)
        return x[keep], v[keep]

    def totals(self) -> tuple[float, float, float]:
        """(number of samples, mean of their times, mean of their bounds)."""
        n, x, v = self._rows[2:, self._begin : self._end].sum(axis=1)
        return float(n), float(x / n), float(v / n)

    def add(self, x: float, v: float, slope: float) -> None:
        """Add a sample, unless it is older than the last one.

        `slope` is the expected growth of the bounds, in s per s.
        """
        rows, bucket = self._rows, math.floor(x / BUCKET_S)
        if bucket < self._bucket:
            return
        if len(self) and bucket == self._bucket:
            last = self._end - 1
            rows[2:, last] += (1.0, x, v)
            if v - slope * x < rows[1, last] - slope * rows[0, last]:
                rows[:2, last] = x, v
            return
        self.forget_before(x - self._window_s)
        if self._end == rows.shape[1]:
            keep = min(len(self), self._most)
            rows[:, :keep] = rows[:, self._end - keep : self._end].copy()
            self._begin, self._end = 0, keep
        rows[:, self._end] = x, v, 1.0, x, v
        self._end += 1
        self._bucket = bucket

    def forget_before(self, x: float) -> None:
        """Forget samples older than `x`, in s."""
        self._begin += int(np.searchsorted(self.x, x))

    def clear(self) -> None:
        """Forget all samples."""
        self._begin = self._end = 0
        self._bucket = -math.inf
