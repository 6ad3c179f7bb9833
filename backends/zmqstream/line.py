"""Bursts on an endless line of silence, read once from beginning to end."""

from typing import NamedTuple

import numpy as np

from backends.base import Samples


class _Laid(NamedTuple):
    start: int
    samples: Samples

    @property
    def end(self) -> int:
        return self.start + len(self.samples)


class Line:
    """They come in order and do not overlap."""

    def __init__(self) -> None:
        self._laid: list[_Laid] = []

    def lay(self, start: int, samples: Samples) -> None:
        """Put a burst down."""
        self._laid.append(_Laid(start, samples))

    def take(self, first: int, n: int) -> Samples:
        """The next `n` samples, from `first` on."""
        out = np.zeros(n, np.complex64)
        while self._laid and self._laid[0].start < first + n:
            burst = self._laid[0]
            begin, end = max(first, burst.start), min(first + n, burst.end)
            if begin < end:
                out[begin - first : end - first] = burst.samples[
                    begin - burst.start : end - burst.start
                ]
            if burst.end > first + n:
                break
            del self._laid[0]
        return out
