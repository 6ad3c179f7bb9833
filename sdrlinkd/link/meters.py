"""Rates and recent ages, sampled so that the path of a message pays nothing for them."""

from collections import deque
from collections.abc import Hashable, Mapping

AGE_SAMPLES = 256


class RateMeter:
    """Mean rates over a sliding window, from counters that are sampled now and then."""

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
        """Whether the last sample is old enough for another."""
        return not self._samples or now - self._samples[-1][0] >= self._step_s

    def grown(self, key: Hashable, value: int, now: float) -> int:
        """How much `key`, whose counter stands at `value` now, has grown within the window."""
        if not self._samples or now - self._began_at <= self._window_s:
            return value
        for at, counters in self._samples:
            if now - at <= self._window_s:
                return value - counters.get(key, 0)
        return 0

    def per_s(self, key: Hashable, value: int, now: float) -> float:
        """Rate of `key`, whose counter stands at `value` now."""
        for at, counters in self._samples:
            if now - at > self._window_s:
                continue
            span = now - at
            return (value - counters.get(key, 0)) / span if span > 0 else 0.0
        return 0.0


class RecentAges:
    """The last ages of one topic, in seconds."""

    __slots__ = ("_ages",)

    def __init__(self) -> None:
        self._ages: deque[float] = deque(maxlen=AGE_SAMPLES)

    def add(self, age_s: float) -> None:
        """Note the age of one message."""
        self._ages.append(age_s)

    def last_ms(self) -> float | None:
        """Age of the newest message."""
        return self._ages[-1] * 1e3 if self._ages else None

    def quantile_ms(self, q: float) -> float | None:
        """The `q` quantile (nearest rank) of the recent ages."""
        if not self._ages:
            return None
        ordered = sorted(self._ages)
        return ordered[min(len(ordered) - 1, int(q * len(ordered)))] * 1e3
