"""Exchanges of stamps between two clocks over a radio with queues."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.random import Generator

AIR_S = 0.002
"""Airtime each way, known to both."""
TURNAROUND_S = 0.001
JITTER_S = 5e-5
LOSS = 0.1
"""Loss rate each way."""
SKEW_PPM = 20.0
WANDER = 2e-8
"""Random walk of the frequency, per √s."""
FARTHEST_S = 5.0
LONGEST_WAIT_S = 0.02
SPAN_S = 5.0

Waits = Callable[[Generator, int, float], tuple[np.ndarray, np.ndarray]]


class Exchange(NamedTuple):
    """A message and its answer: sent, heard there, answered there, heard; each by its own clock.

    None: lost.
    """

    t1: float
    t2: float | None
    t3: float | None
    t4: float | None


class Stream(NamedTuple):
    """Exchanges with the truth: local minus remote time at the local times `at`."""

    exchanges: list[Exchange]
    at: np.ndarray
    offset_s: np.ndarray


def _busy(rng: Generator, n: int, share: float, least_s: float = 0.0) -> np.ndarray:
    """Waiting times in a queue that is busy for a `share` of the time."""
    return (rng.random(n) < share) * rng.uniform(least_s, LONGEST_WAIT_S, n)


def _in_spans(rng: Generator, n: int, hz: float) -> tuple[np.ndarray, np.ndarray]:
    spans = np.arange(n) / hz // SPAN_S + rng.integers(2)
    is_busy = spans % 2 == 1
    return is_busy * _busy(rng, n, 1.0), is_busy * _busy(rng, n, 1.0)


SCENARIOS: dict[str, Waits] = {
    "A": lambda rng, n, _: (_busy(rng, n, 0.6), _busy(rng, n, 0.6)),
    "B": lambda rng, n, _: (_busy(rng, n, 0.9), _busy(rng, n, 0.2)),
    "C": lambda rng, n, _: (_busy(rng, n, 1.0, 0.002), rng.uniform(0, 0.005, n)),
    "D": lambda rng, n, _: (_busy(rng, n, 1.0), _busy(rng, n, 1.0)),
    "J": lambda rng, n, _: (_busy(rng, n, 1.0), _busy(rng, n, 1.0)),
    "L": _in_spans,
}
"""Waiting times each way, by scenario.

A: 40 % idle; B: busy and quiet; C: never idle, asymmetric; D: never idle; J: with 1 ms of jitter,
too; L: alternately busy and idle.
"""


def stream(
    scenario: str,
    seed: int,
    *,
    hz: float = 5.0,
    seconds: float = 60.0,
    step: tuple[float, float] = (np.inf, 0.0),
    bad_share: float = 0.0,
    skew_ppm: float | None = None,
) -> Stream:
    """Make a stream of exchanges.

    `step`: (time, amount) in s by which the remote clock jumps. `bad_share` of the stamps are wrong
    by up to 50 ms.
    """
    rng = np.random.default_rng([seed, ord(scenario), round(hz)])
    n = round(seconds * hz) + 1
    t1 = np.arange(n) / hz
    ppm = rng.normal(0, SKEW_PPM) if skew_ppm is None else skew_ppm
    skew = 1e-6 * ppm + np.cumsum(rng.normal(0, WANDER / np.sqrt(hz), n))
    offset = rng.uniform(-FARTHEST_S, FARTHEST_S) + np.cumsum(skew / hz)
    offset -= step[1] * (t1 >= step[0])
    jitter = 1e-3 if scenario == "J" else JITTER_S
    delays = [
        AIR_S + waits + rng.exponential(jitter, n) for waits in SCENARIOS[scenario](rng, n, hz)
    ]
    wrong = np.where(rng.random((3, n)) < bad_share, rng.uniform(-0.05, 0.05, (3, n)), 0.0)
    arrived = rng.random((2, n)) >= LOSS
    return Stream(exchanges(t1, offset, skew, delays, wrong, arrived), t1, offset)


def exchanges(
    t1: np.ndarray,
    offset: np.ndarray,
    skew: np.ndarray,
    delays: Sequence[np.ndarray],
    wrong: np.ndarray,
    arrived: np.ndarray,
) -> list[Exchange]:
    """The exchanges that begin at the local times `t1`, all in s.

    `offset`, `skew`: local minus remote time, and its growth in s per s. `delays`: there and back.
    `wrong`: errors of t2, t3 and t4. `arrived`: whether each message there and back did.
    """
    t2 = t1 + delays[0] - offset
    t3 = t2 + TURNAROUND_S
    t4 = t3 + offset + skew * TURNAROUND_S + delays[1]
    return [
        Exchange(
            float(t1[i]),
            float(t2[i] + wrong[0, i]) if arrived[0, i] else None,
            float(t3[i] + wrong[1, i]) if arrived[1, i] else None,
            float(t4[i] + wrong[2, i]) if arrived[1, i] else None,
        )
        for i in range(len(t1))
    ]
