"""Simulated air between one node's transmitter and a receiver, on one index."""

from dataclasses import dataclass, field

import numpy as np

from backends.base import Samples
from phy import FrontEnd, FrontEndParams, Path, PathParams


@dataclass(frozen=True)
class Channel:
    """Path and front end of a simulated air; `seed` draws its chance."""

    path: PathParams
    front_end: FrontEndParams = field(default_factory=FrontEndParams)
    seed: int = 0

    def make_path(self) -> Path:
        """The path. Raises ValueError for a profile that does not exist."""
        return Path(self.path, np.random.default_rng([self.seed, 1]))

    def make_front_end(self) -> FrontEnd:
        """The front end, with chance of its own."""
        return FrontEnd(self.front_end, np.random.default_rng([self.seed, 2]))


class Timeline:
    """Bursts laid on an endless line of samples, read once from beginning to end."""

    def __init__(self) -> None:
        self._pieces: list[tuple[int, Samples]] = []

    def add(self, start: int, samples: Samples) -> None:
        """Lay `samples` at `start`; overlapping pieces add up."""
        self._pieces.append((start, samples))

    def take(self, index: int, n: int) -> Samples:
        """The sum of all pieces in `index … index + n`; what is before it is forgotten."""
        out = np.zeros(n, np.complex64)
        kept = []
        for start, samples in self._pieces:
            low, high = max(index, start), min(index + n, start + len(samples))
            if low < high:
                out[low - index : high - index] += samples[low - start : high - start]
            if start + len(samples) > index + n:
                kept.append((start, samples))
        self._pieces = kept
        return out
