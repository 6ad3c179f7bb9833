"""Rows: clocks whose frequency moves, and how often their bound holds."""

from collections.abc import Iterator

import numpy as np

from benchmarks.report import Row
from benchmarks.timesync.filters import PEERS, Ours
from benchmarks.timesync.moving import MOTIONS, Motion, moving
from benchmarks.timesync.rows import PAPER, Tally
from benchmarks.timesync.runs import Course, follow

LONG_S, LONG_RUNS = 3600.0, 2
CONVERGED_S = 130.0
"""Time in s from which errors count; by then, the paper's filter has converged at 5 Hz."""


def measure(seed: int, runs: int, at_most_s: float) -> Iterator[Row]:
    """A row for each motion, and the share of all bounds that hold.

    `at_most_s`: greatest length of a stream in s.
    """
    held, held_at_once = Tally(), Tally()
    shares: dict[str, float] = {}
    for name, motion in MOTIONS.items():
        n = min(runs, LONG_RUNS) if motion.seconds > LONG_S else runs
        ours, papers = [], []
        of_motion = Tally()
        for run in range(n):
            stream = moving(name, seed * 1000 + run, at_most_s=at_most_s)
            ours.append(follow(Ours(motion.resolution_s), stream))
            papers.append(follow(PEERS[PAPER](), stream))
            held_at_once.add(ours[-1])
            for tally in (held, of_motion):
                tally.add(ours[-1], *motion.jumps_at)
        shares[name] = of_motion.percent
        yield _row(name, motion, ours, papers, shares[name])
    worst = min(shares, key=shares.__getitem__)
    yield Row("clock_bound_held_pct", held.percent, "%", 99.9, "more", held.all,
              {"with_5s_after_jumps": held_at_once.percent, f"worst_{worst}": shares[worst]},
              note="moving frequency, without the 5 s after each jump")  # fmt: skip


def _row(
    name: str, motion: Motion, ours: list[Course], papers: list[Course], held_pct: float
) -> Row:
    of_ours, of_paper = (
        np.concatenate([each.errors_us(CONVERGED_S, *motion.jumps_at) for each in courses])
        for courses in (ours, papers)
    )
    bounds_s = np.concatenate([each.bound_s for each in ours])
    peers = {
        PAPER: _rms(of_paper),
        "worst": float(np.abs(of_ours).max()),
        "bound_median": float(1e6 * np.nanmedian(bounds_s)),
        "held_pct": held_pct,
    }
    return Row(f"rms_us_{name}", _rms(of_ours), "µs", None, "less", len(ours), peers)


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
