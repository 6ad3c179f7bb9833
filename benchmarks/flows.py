"""The flows of messages in an experiment, and what became of them."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Times = NDArray[np.float64]


class Flow(NamedTuple):
    """Messages of one topic, by the paper's names: laser, image, u, y.

    Message i leaves at `phase_s + i · period_s · (1 + drift)`, with up to ± `jitter_s` of jitter.
    """

    name: str
    size: int
    """Size of a message in bytes."""
    period_s: float
    count: int  # type: ignore[assignment]  # the word for it
    qos: str = "default"
    """The QoS class, for peers with classes: latency precedes bulk."""
    jitter_s: float = 0.0
    drift: float = 0.0
    phase_s: float = 0.0

    def times(self, rng: np.random.Generator) -> Times:
        """Time at which each message leaves its producer, in s from the experiment's start."""
        exact = self.phase_s + np.arange(self.count) * self.period_s * (1 + self.drift)
        return np.maximum(0.0, exact + self.jitter_s * rng.uniform(-1, 1, self.count))


class Trace(NamedTuple):
    """Send and arrival time of each message of a flow; NaN if it did not arrive."""

    flow: Flow
    sent_at: Times
    heard_at: Times


class Figures(NamedTuple):
    """The columns of the paper's Tables I to IV, in ms, per cent and Mbit/s.

    `jd_ms` is the mean time between two arrivals, `d_ms` the mean delay from producer to consumer.
    """

    jd_ms: float
    std_jd_ms: float
    d_ms: float
    std_d_ms: float
    mdr_pct: float
    mbps: float


def figures(trace: Trace) -> Figures:
    """All columns of one flow; NaN if too few messages arrived."""
    heard = ~np.isnan(trace.heard_at)
    arrived = np.sort(trace.heard_at[heard])
    mdr_pct = 100.0 * float(np.mean(heard)) if len(heard) else 0.0
    if len(arrived) < 3:
        nan = float("nan")
        return Figures(nan, nan, nan, nan, mdr_pct, 0.0)
    between, delay = np.diff(arrived), (trace.heard_at - trace.sent_at)[heard]
    # Relative to the sending time: late arrivals do not reduce the bandwidth.
    took_s = max(float(arrived[-1] - trace.sent_at[0]), trace.flow.period_s * trace.flow.count)
    return Figures(
        1e3 * float(np.mean(between)),
        1e3 * float(np.std(between)),
        1e3 * float(np.mean(delay)),
        1e3 * float(np.std(delay)),
        mdr_pct,
        8e-6 * trace.flow.size * len(arrived) / took_s,
    )
