"""From stamps to latencies: as the paper corrects them, and the true ones (Equations 10 and 11)."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.peers.latency.clock import Clock
from benchmarks.peers.latency.job import Job
from sdrlinkd.link import PaperFilter

Seconds = NDArray[np.float64]


class Stamps(NamedTuple):
    """What the receiver of one direction has recorded."""

    heard: NDArray[np.float64]
    """`[n, 4]`: topic, number, created (s, the sender's clock), arrived (s, the receiver's)."""
    exchanges: NDArray[np.float64]
    """`[n, 4]`: t1 to t4 in s, in order of t4; t1 and t4 by the receiver's clock."""


class Offsets(NamedTuple):
    """A filter's estimates of local minus remote time, in s."""

    at: Seconds
    """Times from which each estimate holds, by the local clock."""
    offset_s: Seconds
    """The estimates; NaN until converged."""


class Direction(NamedTuple):
    """One direction's messages, without those of the warm-up."""

    corrected_s: Seconds
    """Latencies by stamps minus the estimated offset; NaN until it converged."""
    true_s: Seconds
    """True latencies of the same messages, by the machine's clock."""
    n_sent: int
    n_heard: int
    filter_error_s: Seconds
    """Estimated minus true offset at each exchange after the warm-up."""
    stamps: Stamps
    """All stamps, for other filters."""


def estimate(exchanges: NDArray[np.float64]) -> Offsets:
    """Estimate offsets with the paper's filter, given the middle of a reply's remote stamps."""
    paper = PaperFilter()
    offsets = np.full(len(exchanges), np.nan)
    for i, (t1, t2, t3, t4) in enumerate(exchanges):
        paper.update(1e6 * float(t1), 1e6 * float(t2 + t3) / 2, 1e6 * float(t4))
        if paper.converged:
            offsets[i] = 1e-6 * paper.offset_estimated
    return Offsets(exchanges[:, 3], offsets)


def direction(sender: Job, receiver: Job, stamps: Stamps) -> Direction:
    """What the receiver could compute, and the truth."""
    counted = stamps.heard[stamps.heard[:, 1] >= sender.n_warmup]
    created, arrived = counted[:, 2], counted[:, 3]
    offsets = estimate(stamps.exchanges)
    latest = np.searchsorted(offsets.at, arrived, side="right") - 1
    known = np.concatenate([offsets.offset_s, [np.nan]])  # an index of -1: nothing known yet
    true_at = _true(offsets.at, receiver.clock)
    true_offset = offsets.at - _shown(true_at, sender.clock)
    error = offsets.offset_s - true_offset
    settled = true_at >= true_at[:1] + receiver.warmup_s
    return Direction(
        corrected_s=arrived - created - known[latest],
        true_s=_true(arrived, receiver.clock) - _true(created, sender.clock),
        n_sent=sender.n_counted * sender.n_topics,
        n_heard=len(counted),
        filter_error_s=error[settled & np.isfinite(error)],
        stamps=stamps,
    )


def _true(shown: Seconds, clock: Clock) -> Seconds:
    """The machine's time in s at which `clock` shows `shown`."""
    return (shown - clock.offset_s) / clock.rate


def _shown(true: Seconds, clock: Clock) -> Seconds:
    return true * clock.rate + clock.offset_s
