"""The most recent part of an endless stream of samples, by absolute index."""

import numpy as np
from numpy.typing import NDArray

from phy import compute

# Larger values are treated as errors; their squares must stay finite.
LARGEST_SAMPLE = 1e6


class SampleStream:
    """Samples appended at the end and dropped at the beginning; the kept ones are contiguous."""

    def __init__(self, start: int, capacity: int) -> None:
        self._samples = np.zeros(capacity, np.complex64)
        self._begin = 0
        self._size = 0
        self._start = start

    @property
    def start(self) -> int:
        """Absolute index of the oldest sample kept."""
        return self._start

    @property
    def end(self) -> int:
        """Absolute index after the newest sample."""
        return self._start + self._size

    def append(self, samples: NDArray[np.complex64]) -> int:
        """Append samples, with non-finite and too large ones set to 0; returns their number."""
        n = len(samples)
        if self._begin + self._size + n > len(self._samples):
            self._make_room(n)
        at = self._begin + self._size
        room = self._samples[at : at + n]
        room[:] = samples
        self._size += n
        return int(compute.sanitise(room, LARGEST_SAMPLE))

    def view(self, first: int, last: int) -> NDArray[np.complex64]:
        """Samples from `first` up to before `last`, as a view valid until the next `append`."""
        begin = self._begin + first - self._start
        return self._samples[begin : begin + last - first]

    def forget_before(self, index: int) -> None:
        """Drop the samples before `index`."""
        n = min(max(0, index - self._start), self._size)
        self._begin += n
        self._start += n
        self._size -= n

    def restart(self, start: int) -> None:
        """Drop everything; the next sample has index `start`."""
        self._begin, self._size, self._start = 0, 0, start

    def _make_room(self, n: int) -> None:
        kept = self._samples[self._begin : self._begin + self._size]
        if self._size + n > len(self._samples) // 2:
            larger = np.zeros(2 * (self._size + n), np.complex64)
            larger[: self._size] = kept
            self._samples = larger
        else:
            self._samples[: self._size] = kept.copy()
        self._begin = 0
