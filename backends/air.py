"""Simulated air between one node's transmitter and a receiver, on one sample index."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from backends.base import BackendError, Samples
from backends.line import Line
from backends.params import JammerParams
from phy import FrontEnd, FrontEndParams, Jammer, Path, PathParams

AIR_CPU_MS = "air_cpu_ms"


def make_jammers(params: Sequence[JammerParams], noise_dbfs: float, rate_hz: float) -> list[Jammer]:
    """The jammers at a receiver with that noise; all receivers get the same waveforms."""
    return [
        Jammer(
            each.kind, noise_dbfs + each.over_noise_db, rate_hz, i, offset_hz=each.offset_hz,
            width_hz=each.width_hz, period_s=each.period_s, duty=each.duty, times=each.times,
        )
        for i, each in enumerate(params)
    ]  # fmt: skip


@dataclass(frozen=True)
class Channel:
    """Path and front end of a simulated air; `seed` seeds its random numbers."""

    path: PathParams
    front_end: FrontEndParams = field(default_factory=FrontEndParams)
    seed: int = 0
    jammers: Sequence[JammerParams] = ()

    def make_path(self) -> Path:
        """Make the path. Raises BackendError for an unknown profile."""
        try:
            return Path(self.path, np.random.default_rng([self.seed, 1]))
        except ValueError as error:
            raise BackendError(str(error)) from None

    def make_front_end(self) -> FrontEnd:
        """Make the front end, with a random number generator of its own."""
        rng = np.random.Generator(np.random.SFC64([self.seed, 2]))
        return FrontEnd(self.front_end, rng)

    def make_jammers(self) -> list[Jammer]:
        """Make the jammers."""
        return make_jammers(self.jammers, self.front_end.noise_dbfs, self.path.rate_hz)


class AirCost:
    """Measures the CPU time that an air takes, which a physical radio does not take.

    Use it as a context, on one thread; its total is the counter `air_cpu_ms`. One block in EVERY is
    measured and stands for all, because reading a thread's CPU time is slow.
    """

    EVERY = 8

    def __init__(self, counters: dict[str, int]) -> None:
        self._counters = counters
        self._spent_s = self._began_s = 0.0
        self._blocks = 0
        counters[AIR_CPU_MS] = 0

    def __enter__(self) -> None:
        self._blocks += 1
        if self._blocks % self.EVERY == 1:
            self._began_s = time.thread_time()

    def __exit__(self, *_: object) -> None:
        if self._blocks % self.EVERY == 1:
            self._spent_s += self.EVERY * (time.thread_time() - self._began_s)
            self._counters[AIR_CPU_MS] = round(1e3 * self._spent_s)


class Timeline:
    """Bursts on an endless line of samples, which is read once from beginning to end.

    A burst goes through its path when its first sample is read.
    """

    def __init__(self) -> None:
        self._sent: list[tuple[int, Samples, Path]] = []
        self._arriving = Line()

    def add(self, start: int, samples: Samples, path: Path) -> None:
        """Send `samples` at `start` through `path`; overlapping bursts add up."""
        self._sent.append((start, samples, path))

    def take(self, index: int, n: int) -> Samples | None:
        """Samples that arrive in `index … index + n`, None for silence; discards earlier ones."""
        self._carry(index + n)
        return self._arriving.take(index, n)

    def _carry(self, before: int) -> None:
        if not self._sent:
            return
        due = [each for each in self._sent if each[0] - each[2].early < before]
        self._sent = [each for each in self._sent if each[0] - each[2].early >= before]
        for start, samples, path in sorted(due, key=lambda each: each[0]):
            offset, arriving = path.carry(samples)
            self._arriving.lay(start + offset, arriving)
