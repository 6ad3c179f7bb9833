"""What is sent in an experiment, and what came of it."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Times = NDArray[np.float64]


class Flow(NamedTuple):
    """Messages of one topic, in the paper's words: laser, image, u, y.

    Each leaves `phase_s + i · period_s · (1 + drift)`, and up to ± `jitter_s` beside it.
    """

    name: str
    size: int
    """Bytes of a message."""
    period_s: float
    count: int  # type: ignore[assignment]  # the word for it
    qos: str = "default"
    """The class, for those that know any: latency goes before bulk."""
    jitter_s: float = 0.0
    drift: float = 0.0
    phase_s: float = 0.0

    def times(self, rng: np.random.Generator) -> Times:
        """When each message leaves its producer, in s from the experiment's beginning."""
        exact = self.phase_s + np.arange(self.count) * self.period_s * (1 + self.drift)
        return np.maximum(0.0, exact + self.jitter_s * rng.uniform(-1, 1, self.count))


class Trace(NamedTuple):
    """One flow's messages: when each left its producer, and when it came; NaN where it did not."""

    flow: Flow
    sent_at: Times
    heard_at: Times


class Figures(NamedTuple):
    """The columns of the paper's Tables I to IV, in ms, per cent and Mbit/s.

    `jd_ms` is the mean time between two messages that arrive, `d_ms` that from producer to
    consumer.
    """

    jd_ms: float
    std_jd_ms: float
    d_ms: float
    std_d_ms: float
    mdr_pct: float
    mbps: float


def figures(trace: Trace) -> Figures:
    """All columns of one flow; NaN where too few messages came."""
    heard = ~np.isnan(trace.heard_at)
    arrived = np.sort(trace.heard_at[heard])
    mdr_pct = 100.0 * float(np.mean(heard)) if len(heard) else 0.0
    if len(arrived) < 3:
        nan = float("nan")
        return Figures(nan, nan, nan, nan, mdr_pct, 0.0)
    between, delay = np.diff(arrived), (trace.heard_at - trace.sent_at)[heard]
    # Over the time in which they were sent: what comes late is no bandwidth lost.
    took_s = max(float(arrived[-1] - trace.sent_at[0]), trace.flow.period_s * trace.flow.count)
    return Figures(
        1e3 * float(np.mean(between)),
        1e3 * float(np.std(between)),
        1e3 * float(np.mean(delay)),
        1e3 * float(np.std(delay)),
        mdr_pct,
        8e-6 * trace.flow.size * len(arrived) / took_s,
    )
