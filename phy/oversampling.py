"""Resamples to twice or four times the rate and back, for radios that are faster than the modem.

The filter is a linear-phase low-pass (Kaiser, 60 dB) that passes the subcarriers in use and removes
their images: 802.11's outermost subcarrier is at 0.41 of the modem's rate, its first image at 0.59.
"""

import numpy as np
from numpy.typing import NDArray

from phy import compute

REACH = 16
"""Samples at the low rate on each side of a sample that contribute to it."""
# Cutoff relative to the low rate: midway between the outermost subcarrier and its first image.
_CUTOFF = 0.5
_KAISER_BETA = 5.65
# Zeros after the samples to be filtered, for the last lanes.
_REST = np.zeros(4, np.complex64)


def low_pass(factor: int) -> NDArray[np.float32]:
    """The filter's taps at the high rate `[2 factor REACH + 1]`; their sum is 1."""
    n = np.arange(-factor * REACH, factor * REACH + 1)
    taps = np.sinc(2 * _CUTOFF * n / factor) * np.kaiser(len(n), _KAISER_BETA)
    unit: NDArray[np.float32] = (taps / taps.sum()).astype(np.float32)
    return unit


def upsample(burst: NDArray[np.complex64], factor: int) -> NDArray[np.complex64]:
    """A burst `[n]` at `factor` times its rate `[(n + 2 REACH) · factor]`.

    The result includes the filter's rise and fall: sample `i` of the burst is at `(i + REACH) ·
    factor`.
    """
    n = len(burst) + 2 * REACH
    padded = np.zeros(len(burst) + 4 * REACH + len(_REST), np.complex64)
    padded[2 * REACH : 2 * REACH + len(burst)] = burst
    out = np.empty(n * factor, np.complex64)
    taps = low_pass(factor) * np.float32(factor)
    for phase in range(factor):
        # Of every `factor` samples all but one are zero, and so are their products with taps.
        own = _twice(taps[-phase % factor :: factor])
        compute.filter_strided(padded, min(phase, 1), 1, own, out[phase:], factor, n)
    return out


class Downsampler:
    """Brings a stream from `factor` times the modem's rate down to it, independent of chunking."""

    def __init__(self, factor: int) -> None:
        self._factor = factor
        self._taps = _twice(low_pass(factor))
        self._kept = np.zeros(0, np.complex64)
        self.restart(0)

    def restart(self, index: int) -> None:
        """Restart: the next sample has this index at the high rate, with silence before it."""
        reach = self._factor * REACH
        self.next_index = -(-index // self._factor)
        """Index of the next output sample at the low rate."""
        self._end = index
        self._kept = np.zeros(index - self.next_index * self._factor + reach, np.complex64)

    def push(self, samples: NDArray[np.complex64]) -> NDArray[np.complex64]:
        """Take samples `[n]`; returns the low-rate samples that they complete, REACH late."""
        factor, reach = self._factor, self._factor * REACH
        x = np.concatenate((self._kept, samples, _REST))
        self._end += len(samples)
        n = max(0, (self._end - reach - 1) // factor + 1 - self.next_index)
        out = np.empty(n, np.complex64)
        compute.filter_strided(x, 0, factor, self._taps, out, 1, n)
        self.next_index += n
        self._kept = x[n * factor : -len(_REST)]
        return out

    def flush(self) -> NDArray[np.complex64]:
        """Return the last low-rate samples, as if silence followed."""
        return self.push(np.zeros(self._factor * REACH, np.complex64))


def _twice(taps: NDArray[np.float32]) -> NDArray[np.float32]:
    """Each of `taps` twice, for real and imaginary part, zero-padded to whole lanes."""
    out = np.zeros(-(-2 * len(taps) // 8) * 8, np.float32)
    out[: 2 * len(taps)] = np.repeat(taps, 2)
    return out
