"""Levels of received samples: mean, peak and recent level."""

import math

import numpy as np

from backends import Samples

FULL = 0.97
"""Values from here on count as clipped; DC removal may move full scale away from 1."""
RECENT_S = 0.2
LEAST = 1e-20


class LevelMeter:
    """Measures power relative to a full-scale tone, of all samples and of the latest ones."""

    def __init__(self, rate_hz: float) -> None:
        self._rate_hz = rate_hz
        self._energy = self._recent = self._peak = 0.0
        self.n_samples = 0
        self.n_full = 0
        """Number of values, two per sample, at or beyond full scale."""

    def add(self, samples: Samples) -> None:
        """Add the next samples."""
        n = len(samples)
        if not n:
            return
        parts = np.ascontiguousarray(samples).view(np.float32)
        powers = np.square(parts)
        powers = powers[::2] + powers[1::2]
        energy = float(powers.sum(dtype=np.float64))
        if not math.isfinite(energy):
            self.add(np.nan_to_num(samples, posinf=1, neginf=-1))
            return
        self.n_samples += n
        self._energy += energy
        self._recent += min(1.0, n / (RECENT_S * self._rate_hz)) * (energy / n - self._recent)
        peak = float(powers.max())
        self._peak = max(self._peak, peak)
        if peak >= FULL**2:
            self.n_full += int(np.count_nonzero(np.abs(parts) >= FULL))

    @property
    def mean_dbfs(self) -> float:
        """Mean power of all samples in dBFS."""
        return _decibel(self._energy / max(1, self.n_samples))

    @property
    def peak_dbfs(self) -> float:
        """Power of the strongest sample in dBFS."""
        return _decibel(self._peak)

    @property
    def recent_dbfs(self) -> float:
        """Mean power of the last fifth of a second in dBFS."""
        return _decibel(self._recent)


def _decibel(power: float) -> float:
    return 10 * math.log10(max(power, LEAST))
