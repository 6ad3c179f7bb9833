"""Runs a filter over a stream, and keeps its error over time."""

from typing import NamedTuple

import numpy as np

from benchmarks.timesync.filters import Filter, Ours
from benchmarks.timesync.streams import Stream

NEAR_S = 1e-3
RECOVERED_S = 2e-3
SETTLING_S = 5.0


class Course(NamedTuple):
    """Errors and bounds at the times `at`, each just before the next exchange; NaN: none."""

    at: np.ndarray
    error_s: np.ndarray
    bound_s: np.ndarray

    @property
    def last_error_s(self) -> float:
        """The error at the end, in s."""
        return float(self.error_s[-1])

    def settled_s(self, near_s: float = NEAR_S, since: float = 0.0) -> float:
        """Time after `since` from which errors stay below `near_s`; inf: never."""
        after = self.at >= since
        wrong = np.flatnonzero(~(np.abs(self.error_s[after]) < near_s))
        if not len(wrong):
            return 0.0
        if wrong[-1] + 1 == np.count_nonzero(after):
            return float("inf")
        return float(self.at[after][wrong[-1] + 1] - since)

    def held(self, *steps_at: float) -> tuple[int, int]:
        """(errors within their bound, errors with a bound), without the 5 s after each step."""
        counts = np.isfinite(self.bound_s) & self._settled(*steps_at)
        good = np.abs(self.error_s[counts]) <= self.bound_s[counts]
        return int(np.count_nonzero(good)), int(np.count_nonzero(counts))

    def errors_us(self, since: float, *steps_at: float) -> np.ndarray:
        """The errors from `since` in s on, without the 5 s after each step, in µs."""
        counts = np.isfinite(self.error_s) & (self.at >= since) & self._settled(*steps_at)
        errors_us: np.ndarray = 1e6 * self.error_s[counts]
        return errors_us

    def _settled(self, *steps_at: float) -> np.ndarray:
        settled = np.ones(len(self.at), bool)
        period_s = self.at[1] - self.at[0]
        for step_at in steps_at:
            # The error just before the exchange at which the clock steps contains the step.
            settled &= (self.at < step_at - 1.5 * period_s) | (self.at > step_at + SETTLING_S)
        return settled


def follow(filter_: Filter, stream: Stream) -> Course:
    """The course of a filter's output over a stream."""
    n = len(stream.exchanges) - 1
    error_s, bound_s = np.full(n, np.nan), np.full(n, np.nan)
    for i, exchange in enumerate(stream.exchanges[:-1]):
        filter_.take(exchange)
        at = float(stream.at[i + 1])
        offset_s = filter_.offset(at)
        truth_s = float(stream.offset_s[i])
        # A step that comes with the next exchange cannot be known yet.
        error_s[i] = np.nan if offset_s is None else offset_s - truth_s - _drift(stream, i)
        if isinstance(filter_, Ours):
            bound_s[i] = filter_.bound(at)
    return Course(stream.at[:-1], error_s, bound_s)


def _drift(stream: Stream, i: int) -> float:
    """Drift of the clocks until the next exchange, without steps."""
    moved = float(stream.offset_s[i + 1] - stream.offset_s[i])
    return moved if abs(moved) < RECOVERED_S else 0.0
