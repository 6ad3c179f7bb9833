"""Tracking: follows the phase of all subcarriers and its slope over them by two Kalman filters.

The phase changes with the residual offset and the oscillators' noise. The slope grows as the
sender's sampling clock drifts away from ours.
"""

import cmath
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from phy.numerology import Numerology
from phy.reference.channel import Channel
from phy.reference.ofdm import Subcarriers

PHASE_NOISE = (5e-5, 1e-10)
SLOPE_NOISE = (1e-10, 1e-15)
"""Process noise of (value, rate) per symbol: oscillator noise and modelling errors."""
INTERFERENCE, MOVEMENT = 3.0, 6.0
"""Excess of the pilots' errors over what is expected, as a factor, that is not chance."""
DIFFER = 2.5
"""The same if phase and amplitude count: it only hastens what is due."""
STEP = 4.5
"""Number of standard deviations from which a difference in amplitude or phase is a step of it."""
LEAST_STEP = 0.08
"""A smaller step, relative or in radians, is left to the filters, which are there as soon."""
CLEARLY = 0.03
"""Variance in rad² up to which pilots tell a step of phase: with more noise, angles mislead."""
LAST = 0.3
"""Share of a difference in amplitude with which its filter ends: that of the third symbol."""
FREQUENCY_ERROR_0_DB, FREQUENCY_ERROR_MIN = 0.006, 0.0005
"""Error of the preamble's offset in subcarrier spacings: at 0 dB, and at best."""
CLOCK_ERROR, CLOCK_DOUBT = 40e-6, 5e-6
"""Standard deviations of a clock's error: unknown, and derived from the centre frequency."""


class Kalman:
    """A Kalman filter with the state (value, rate), one step per symbol.

    Its matrices are so small that plain numbers are faster.
    """

    def __init__(self, noise: tuple[float, float], rate: float, rate_deviation: float) -> None:
        self.value, self.rate = 0.0, rate
        # The covariance (a b; b c).
        self._a, self._b, self._c = 0.0, 0.0, rate_deviation**2
        self._noise = noise

    @property
    def covariance(self) -> tuple[float, float, float]:
        """Variance of the value, covariance, variance of the rate."""
        return self._a, self._b, self._c

    def predict(self) -> None:
        """Advance by one symbol: x = F x, C = F C Fᵀ + Q, with F = (1 1; 0 1)."""
        self.value += self.rate
        self._a += 2 * self._b + self._c + self._noise[0]
        self._b += self._c
        self._c += self._noise[1]

    def correct_surely(self, innovation: float, variance: float) -> None:
        """Correct; what surprises by more than STEP standard deviations is believed at once.

        Else data decided in a wrong quadrant would turn the gains along, for ever.
        """
        total = self._a + variance
        is_step = abs(innovation) > LEAST_STEP and innovation**2 > STEP**2 * total
        if is_step and total < CLEARLY:
            self._a += innovation**2
        self.correct(innovation, variance)

    def correct(self, innovation: float, variance: float) -> None:
        """Correct by a measured deviation: x += K i, C −= K C₀, K = C₀ / (C₀₀ + variance)."""
        a, b = self._a, self._b
        of_value, of_rate = a / (a + variance), b / (a + variance)
        self.value += of_value * innovation
        self.rate += of_rate * innovation
        self._a, self._b, self._c = a - of_value * a, b - of_value * b, self._c - of_rate * b


class Shown(NamedTuple):
    """What a symbol's pilots show besides phase and slope."""

    no: float
    """The noise on a subcarrier, interference included."""
    movement: float
    """The power by which the gains' errors exceed their doubt."""
    amplitude: float
    """The step of all gains: 1 if there is none."""
    differ: bool
    """Whether the pilots differ at all, which asks for a correction of the channel."""


class Tracking:
    """Tracks phase φ and slope s of a burst by its pilots, symbol by symbol.

    `clock_error` is the relative excess of the sender's sampling clock as derived from the centre
    frequency, None if unknown.
    """

    def __init__(self, grid: Numerology, channel: Channel, clock_error: float | None) -> None:
        self._grid = grid
        self._k, self._pilots = grid.used[grid.pilots_at], grid.pilot_values
        # Factor from a frequency in subcarrier spacings to the phase per symbol.
        turn = 2 * np.pi * grid.n_symbol / grid.n_fft
        offset = max(FREQUENCY_ERROR_0_DB * np.sqrt(channel.no / channel.gain), FREQUENCY_ERROR_MIN)
        doubt = CLOCK_ERROR if clock_error is None else CLOCK_DOUBT
        # Errors of the last symbol's pilots.
        self._missed = np.zeros(len(self._k), np.complex128)
        self.phase = Kalman(PHASE_NOISE, 0.0, turn * offset)
        self.slope = Kalman(SLOPE_NOISE, turn * (clock_error or 0.0), turn * doubt)

    def predict(self) -> None:
        """Advance by one symbol: φ and s change by their rates."""
        self.phase.predict()
        self.slope.predict()

    @property
    def angle(self) -> NDArray[np.float64]:
        """The phase of each subcarrier in use `[n_used]`: φ + sk."""
        return np.asarray(self.phase.value + self.slope.value * self._grid.used, np.float64)

    def correct(
        self, pilots: Subcarriers, polarity: float, channel: Channel, kept: NDArray[np.float32],
        no: float,
    ) -> Shown:  # fmt: skip
        """Correct φ and s by a symbol's pilots `[n_pilots]`; returns what else they show.

        A pilot with 0 in `kept` has no weight. `no` is N, as far as it is known before.

        θ_p = arg(Y_p Ĥ*_p P_p) − φ − s k_p;  S_i = Σ|Ĥ_p|² k_p^i
        Var(φ) = N/2 · S₂ / (S₀S₂ − S₁²),  Var(s) = N/2 · S₀ / (S₀S₂ − S₁²)
        """
        k, h = self._k, channel.h[self._grid.pilots_at] * kept
        back = np.exp(-1j * (self.phase.value + self.slope.value * k))
        turned = pilots * h.conj() * (polarity * self._pilots) * back
        return self.correct_by(turned, np.abs(h) ** 2, k, channel, no)

    def correct_by(
        self,
        turned: Subcarriers,
        weight: NDArray[np.float64],
        k: NDArray[np.int64],
        channel: Channel,
        no: float,
    ) -> Shown:
        """Correct φ and s by weighted least squares over the angles of the pilots.

        `turned` is the received pilots, rotated back as predicted, times the conjugate of the
        expected ones; `weight` is |Ĥ_p|², `k` are the subcarriers, each `[n]`. Pilots that differ
        by more than the noise and the gains' doubt are evidence: of interference if they differed
        otherwise a symbol before, else of movement.
        """
        doubt, spread = channel.doubt, channel.spread
        total, expected = complex(turned.sum()), float(weight.sum())
        if total == 0 or expected <= 0:
            return Shown(no, 0.0, 1.0, False)
        more = abs(total) / expected - 1
        variance = (no + doubt) / (2 * expected)
        if abs(more) > LEAST_STEP and more**2 > STEP**2 * (variance + spread):
            spread = 1.0
        amplitude = 1 + more * spread / (spread + variance)
        # First the common phase; then the remaining angles are small: arg z ≈ Im z/|z|.
        common = cmath.phase(total)
        aligned = turned * cmath.exp(-1j * common)
        missed, heard = aligned - amplitude * weight, weight > 0
        residual = _size(missed[heard], weight[heard])
        change = _size((missed - self._missed)[heard], weight[heard])
        self._missed = np.where(heard, missed, self._missed)
        n, movement = len(turned), 0.0
        whole = _size((turned - weight)[heard], weight[heard])
        differ = whole > DIFFER * (n * (no + doubt) + self.phase.covariance[0] * expected)
        foreign = min(residual, change - n * no)
        is_foreign = foreign > INTERFERENCE * n * (no + doubt)
        if is_foreign:
            no = foreign / n
        elif residual > MOVEMENT * n * (no + doubt):
            movement = residual / n - no - doubt
        noise = no + doubt + movement
        if spread > 0:
            share = spread / (spread + noise / (2 * expected))
            amplitude, spread = 1 + more * share, spread * (1 - share)
            # From here on, the gains' own filters do better.
            spread = spread if share >= LAST else 0.0
        channel.spread = spread
        pilots = list(zip(aligned.tolist(), weight.tolist(), k.tolist(), strict=True))
        s0, s1, s2 = (sum(w * k**i for _, w, k in pilots) for i in range(3))
        # The sum Σ θ of the weighted angles is 0 by the choice of the common phase.
        t1 = sum(z.imag * k for z, _, k in pilots)
        det = s0 * s2 - s1 * s1
        if det > 0:
            correct = self.phase.correct if is_foreign else self.phase.correct_surely
            correct(common - s1 * t1 / det, noise / 2 * s2 / det)
            self.slope.correct(s0 * t1 / det, noise / 2 * s0 / det)
        return Shown(no, movement, amplitude, differ)

    def slip(self, early: int) -> None:
        """Reduce the slope for windows that begin `early` samples earlier."""
        self.slope.value -= early * 2 * np.pi / self._grid.n_fft


def _size(errors: NDArray[np.complex128], weight: NDArray[np.float64]) -> float:
    """Sum of the squares of errors of Ĥ_p* Y_p, as errors of Y_p."""
    return float(np.sum(np.abs(errors) ** 2 / weight))
