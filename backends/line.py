"""Bursts on an endless line of samples, which is read once from beginning to end."""

import numpy as np

from backends.base import Samples


class Line:
    """Samples to come, by index; overlapping ones add up."""

    def __init__(self) -> None:
        self._laid: list[tuple[int, Samples]] = []

    def __len__(self) -> int:
        """Number of bursts that have not been read to their end."""
        return len(self._laid)

    def lay(self, start: int, samples: Samples) -> None:
        """Put samples down from index `start` on."""
        self._laid.append((start, samples))

    def take(self, index: int, n: int) -> Samples | None:
        """Samples in `index … index + n`, None for silence; discards earlier ones."""
        if not self._laid:
            return None
        out = np.zeros(n, np.complex64)
        kept = []
        for start, samples in self._laid:
            low, high = max(index, start), min(index + n, start + len(samples))
            if low < high:
                out[low - index : high - index] += samples[low - start : high - start]
            if start + len(samples) > index + n:
                kept.append((start, samples))
        self._laid = kept
        return out
