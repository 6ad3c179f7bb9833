"""Rates computed from samples of counters, at no cost for the processing of messages."""

from collections import deque
from collections.abc import Hashable, Mapping


class RateMeter:
    """Mean rates over a sliding window, from counters that are sampled periodically."""

    def __init__(self, window_s: float, step_s: float = 0.5) -> None:
        self._window_s = window_s
        self._step_s = step_s
        self._began_at = float("inf")
        self._samples: deque[tuple[float, dict[Hashable, int]]] = deque()

    def sample(self, counters: Mapping[Hashable, int], now: float) -> None:
        """Remember the counters' values at `now`."""
        while self._samples and now - self._samples[0][0] > self._window_s:
            self._samples.popleft()
        self._began_at = min(self._began_at, now)
        self._samples.append((now, dict(counters)))

    def is_due(self, now: float) -> bool:
        """Whether the last sample is old enough to take another."""
        return not self._samples or now - self._samples[-1][0] >= self._step_s

    def grown(self, key: Hashable, value: int, now: float) -> int:
        """Growth of the counter `key`, which is at `value` now, within the window."""
        if not self._samples or now - self._began_at <= self._window_s:
            return value
        for at, counters in self._samples:
            if now - at <= self._window_s:
                return value - counters.get(key, 0)
        return 0

    def all_per_s(self, counters: Mapping[Hashable, int], now: float) -> dict[Hashable, float]:
        """Rates per second of all `counters`, given with their present values."""
        return {key: self.per_s(key, value, now) for key, value in counters.items()}

    def per_s(self, key: Hashable, value: int, now: float) -> float:
        """Rate per second of the counter `key`, which is at `value` now."""
        for at, counters in self._samples:
            if now - at > self._window_s:
                continue
            span = now - at
            return (value - counters.get(key, 0)) / span if span > 0 else 0.0
        return 0.0
