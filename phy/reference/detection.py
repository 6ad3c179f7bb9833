"""Detection: finds the short training, 192 samples that follow our code, at any signal level.

Segment i of the short training is segment i − 1 times b_i. So the product of each sample with the
one 16 before it, times b_i, has the same phase throughout, whatever the channel: that of 16 samples
of frequency offset. A signal that repeats without the code adds up to little.
"""

import cmath
import math

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from phy.preamble import BARKER, SEGMENT, SHORT
from phy.reference.ofdm import Samples

HISTORY = SHORT - 1
"""Number of samples before a sample that its metric needs."""
HOP = 512
"""Number of samples with the same threshold and DC."""
THRESHOLD = 0.25
MOST = 0.5
"""Limit up to which false alarms raise the threshold."""
WARIER = 0.1
"""Amount by which each false alarm raises the threshold."""
FORGETS = 4096
"""Number of samples in which a raised threshold decays by a factor of e."""
PLAINEST = 0.7
"""A peak whose sum without the code exceeds this share of it is not a preamble."""
SLOWEST = 1 / 64
"""Least weight of each hop's mean in the DC, and of its power in that of the noise."""
GATE = 1.15
"""A half of a hop with more power than this times the noise is searched."""
PATIENCE = 4096
"""A power is that of noise once so many hops were searched in vain."""
LOWER = 0.7
"""A hop, or the noise of a burst, with less than this share of the noise: it was not noise."""


def sums(x: NDArray[np.complexfloating], dc: complex) -> tuple[Samples, NDArray[np.float64]]:
    """Compute P and E `[n]` of the last n of the samples `[191 + n]`.

    P[n] = Σ_{k=0}^{10} b_k Σ_{m=0}^{15} y[n−16(10−k)−m] y*[n−16(11−k)−m]
    E[n] = 11/12 Σ_{m=0}^{191} |y[n−m]|²
    """
    q = _neighbors(x, dc)
    n = len(x) - HISTORY
    p = np.zeros(n, np.complex128)
    for k, sign in enumerate(BARKER):
        p += sign * q[SEGMENT * k : SEGMENT * k + n]
    power = np.abs(x.astype(np.complex128) - dc) ** 2
    e = (SHORT - SEGMENT) / SHORT * sliding_window_view(power, SHORT).sum(axis=-1)
    return p, e


def _neighbors(x: NDArray[np.complexfloating], dc: complex) -> Samples:
    """Compare each segment with the one before it: entry i is Σ_{m=0}^{15} y[i+16+m] y*[i+m]."""
    y = x.astype(np.complex128) - dc
    products = y[SEGMENT:] * y[:-SEGMENT].conj()
    total: Samples = sliding_window_view(products, SEGMENT).sum(axis=-1)
    return total


class Detector:
    """Detects preambles; keeps DC, noise, and the threshold raised by false alarms.

    What misleads `noise`: a search that begins within a burst, a foreign signal that stays or ends,
    another gain. Too low, it costs only time: all is searched, and after PATIENCE hops it is right.
    It cannot be too high for longer than a hop: noise shows as soon as nobody sends, and each burst
    that is read tells its noise.
    """

    def __init__(self, start: int) -> None:
        self.dc = 0j
        self.noise = 0.0
        """Power of the hops without a burst; 0: unknown."""
        self._n_sure = self._n_above = 0
        self._hops_seen = 0
        self._excess, self._raised_at = 0.0, start

    def crossing(self, x: NDArray[np.complexfloating], at: int) -> int | None:
        """Find the first of 512 samples with |P| > threshold · E, or None.

        `x` `[191 + 512]` ends with those samples; the first of them has the absolute index `at`.
        The result is an absolute index. Hops with the power of noise are taken to have no crossing.
        A hop without a crossing updates DC and noise.
        """
        y = x[HISTORY:].astype(np.complex128) - self.dc
        halves = (np.abs(y) ** 2).reshape(2, -1).mean(axis=1)
        is_above = bool(halves.max() > GATE * self.noise)
        if is_above or self._n_sure < PATIENCE:
            level = THRESHOLD + self._excess_at(at)
            p, e = sums(x, self.dc)
            over = np.abs(p) ** 2 > level**2 * e**2
            if over.any():
                return at + int(over.argmax())
        power, mean = float(halves.mean()), complex(y.mean())
        if power < LOWER * self.noise or abs(mean) ** 2 > power / 2:
            # A strong signal has ended, and its mean was no DC; or the DC has jumped.
            self._hops_seen = 0
        self._follow_noise(power, is_above)
        self._hops_seen += 1
        self.dc += max(SLOWEST, 1 / self._hops_seen) * mean
        return None

    def heard(self, noise: float) -> None:
        """Note a burst that was read beside `noise`: signals are on the air, and no more noise."""
        self._n_above = 0
        if noise < LOWER * self.noise:
            self._n_sure = 0

    def _follow_noise(self, power: float, is_above: bool) -> None:
        if self.noise == 0 or power < LOWER * self.noise:
            self.noise, self._n_sure, self._n_above = power, 0, 0
        elif not is_above:
            self.noise += SLOWEST * (power - self.noise)
            self._n_sure, self._n_above = min(self._n_sure + 1, PATIENCE), 0
        elif self._n_above < PATIENCE:
            self._n_above += 1
        else:
            # A permanent signal is noise.
            self.noise, self._n_sure, self._n_above = power, PATIENCE, 0

    def strongest(self, x: NDArray[np.complexfloating]) -> tuple[int, float | None]:
        """Find the largest |P| / E after 191 samples of `x`; returns (its offset, frequency).

            f = arg P / (2π16), modulo 1/16 cycles a sample

        The frequency is None if |Σ_k Σ_m …|, P without the code, exceeds 0.7 |P|, as for Wi-Fi,
        constant levels and slow neighbors.
        """
        p, e = sums(x, self.dc)
        metric = np.divide(np.abs(p) ** 2, e**2, out=np.full(len(p), -1.0), where=e > 0)
        best = int(metric.argmax())
        if metric[best] <= 0:
            return best, None
        q = _neighbors(x, self.dc)
        plain = abs(q[best : best + SHORT - SEGMENT : SEGMENT].sum())
        if plain > PLAINEST * abs(p[best]):
            return best, None
        return best, cmath.phase(p[best]) / (2 * math.pi * SEGMENT)

    def was_nothing(self, peak: int) -> None:
        """Raise the threshold after a false alarm at `peak`: its source may return."""
        self._excess = min(self._excess_at(peak) + WARIER, MOST - THRESHOLD)
        self._raised_at = peak

    def _excess_at(self, index: int) -> float:
        """Excess of the raised threshold at an absolute index."""
        return self._excess * math.exp((self._raised_at - index) / FORGETS)
