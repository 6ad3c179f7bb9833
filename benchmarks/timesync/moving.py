"""Streams of clocks whose frequency moves, and of clocks and stamps that are disturbed.

Messages wait as in scenario A. Stamps by the sample have no queue: they are rounded to samples.
"""

import zlib
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.random import Generator

from benchmarks.timesync.streams import (
    AIR_S,
    FARTHEST_S,
    JITTER_S,
    LOSS,
    SCENARIOS,
    SKEW_PPM,
    WANDER,
    Stream,
    exchanges,
)

PPM = 1e-6
HOST_RESOLUTION_S = 2e-5
SAMPLE_S = 2e-7
"""Length of a sample at 5 Msps."""
NEAR_S = 1e-6
"""Longest time that a burst travels, with stamps by the sample."""
HZ = 5.0


class Motion(NamedTuple):
    """How a clock moves, and how it is seen."""

    rate: Callable[[np.ndarray], np.ndarray]
    """Growth of local minus remote time at local times in s, in s per s."""
    seconds: float = 300.0
    jumps_at: tuple[float, ...] = ()
    """Local times in s at which the clock or its rate jumps."""
    leap_s: float = 0.0
    """Amount by which local minus remote time jumps at `jumps_at`, up and down in turn."""
    wander: float = WANDER
    """Random walk of the frequency, per √s."""
    hz: float = HZ
    loss: float = LOSS
    early_share: float = 0.0
    """Share of arrivals with stamps too early by up to 5 ms."""
    wrong_share: float = 0.0
    """Share of stamps wrong by up to 50 ms."""
    by_sample: bool = False

    @property
    def resolution_s(self) -> float:
        """Resolution of the stamps in s."""
        return SAMPLE_S if self.by_sample else HOST_RESOLUTION_S


def _steady(at: np.ndarray) -> np.ndarray:
    return 0.0 * at


def _jump(ppm: float) -> Motion:
    return Motion(lambda at: ppm * PPM * (at >= 120), jumps_at=(120.0,))


MOTIONS: dict[str, Motion] = {
    "ramp_1ppm_a_min": Motion(lambda at: PPM * at / 60),
    "ramp_10ppm_in_60s": Motion(lambda at: 10 * PPM * np.clip((at - 120) / 60, 0, 1)),
    "warm_up_20ppm": Motion(lambda at: 20 * PPM * (1 - np.exp(-at / 120)), 600.0),
    "sine_3ppm_2min": Motion(lambda at: 3 * PPM * np.sin(2 * np.pi * at / 120), 600.0),
    "rate_jump_2ppm": _jump(2),
    "rate_jump_20ppm": _jump(20),
    "rate_jump_200ppm": _jump(200),
    "slew_500ppm_20s": Motion(
        lambda at: 500 * PPM * ((at >= 120) & (at < 140)), jumps_at=(120.0, 140.0)
    ),
    "leap_0.4ms": Motion(_steady, jumps_at=(120.0,), leap_s=4e-4),
    "early_1pct": Motion(_steady, early_share=0.01),
    "hours_4ppm_a_day": Motion(
        lambda at: 4 * PPM * at / 86400, 21600.0, jumps_at=(7000.0, 15000.0), leap_s=1.0,
        hz=1.0, loss=0.2, wrong_share=0.01,
    ),
    "by_sample_wander": Motion(_steady, by_sample=True),
    "by_sample_1ppm_a_min": Motion(lambda at: PPM * at / 60, by_sample=True),
}  # fmt: skip


def moving(name: str, seed: int, *, at_most_s: float = np.inf) -> Stream:
    """The stream of a motion; `at_most_s` is its greatest length in s."""
    motion = MOTIONS[name]
    rng = np.random.default_rng([seed, zlib.crc32(name.encode())])
    hz, seconds = motion.hz, min(motion.seconds, at_most_s)
    n = round(seconds * hz) + 1
    t1 = np.arange(n) / hz
    skew = PPM * rng.normal(0, SKEW_PPM) + motion.rate(t1)
    skew += np.cumsum(rng.normal(0, motion.wander / np.sqrt(hz), n))
    offset = rng.uniform(-FARTHEST_S, FARTHEST_S) + np.cumsum(skew / hz)
    for number, jump_at in enumerate(motion.jumps_at):
        offset += (-1) ** number * motion.leap_s * (t1 >= jump_at)
    if motion.by_sample:
        delays = [AIR_S + rng.uniform(0, NEAR_S) + np.zeros(n)] * 2
        wrong = rng.uniform(-SAMPLE_S / 2, SAMPLE_S / 2, (3, n))
    else:
        waits = SCENARIOS["A"](rng, n, hz)
        delays = [AIR_S + wait + rng.exponential(JITTER_S, n) for wait in waits]
        wrong = _wrong(rng, motion, n)
    arrived = rng.random((2, n)) >= motion.loss
    return Stream(exchanges(t1, offset, skew, delays, wrong, arrived), t1, offset)


def _wrong(rng: Generator, motion: Motion, n: int) -> np.ndarray:
    """Errors of t2, t3 and t4 in s."""
    wrong = np.where(rng.random((3, n)) < motion.wrong_share, rng.uniform(-0.05, 0.05, (3, n)), 0.0)
    # Not t3: a departure that seems early is like a longer delay.
    is_early = rng.random((2, n)) < motion.early_share
    wrong[[0, 2]] -= np.where(is_early, rng.uniform(0, 0.005, (2, n)), 0.0)
    return wrong
