"""Tracking: follows the phase of all subcarriers and its slope over them by two Kalman filters.

The phase changes with the residual offset and the oscillators' noise. The slope grows as the
sender's sampling clock drifts away from ours.
"""

import cmath

import numpy as np
from numpy.typing import NDArray

from phy.numerology import Numerology
from phy.reference.channel import Channel
from phy.reference.ofdm import Subcarriers

PHASE_NOISE = (5e-5, 1e-10)
SLOPE_NOISE = (1e-10, 1e-15)
"""Process noise of (value, rate) per symbol: oscillator noise and modelling errors."""
SURPRISE = 6.0
"""Excess of pilot noise over N, as a factor, at which pilots and their symbol lose trust."""
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

    def correct(self, innovation: float, variance: float) -> None:
        """Correct by a measured deviation: x += K i, C −= K C₀, K = C₀ / (C₀₀ + variance)."""
        a, b = self._a, self._b
        of_value, of_rate = a / (a + variance), b / (a + variance)
        self.value += of_value * innovation
        self.rate += of_rate * innovation
        self._a, self._b, self._c = a - of_value * a, b - of_value * b, self._c - of_rate * b


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

    def correct(self, pilots: Subcarriers, polarity: float, channel: Channel) -> float:
        """Correct φ and s by a symbol's pilots `[n_pilots]`; returns the noise that they show.

        θ_p = arg(Y_p Ĥ*_p P_p) − φ − s k_p;  S_i = Σ|Ĥ_p|² k_p^i
        Var(φ) = N/2 · S₂ / (S₀S₂ − S₁²),  Var(s) = N/2 · S₀ / (S₀S₂ − S₁²)
        """
        k, h = self._k, channel.h[self._grid.pilots_at]
        back = np.exp(-1j * (self.phase.value + self.slope.value * k))
        turned = pilots * h.conj() * (polarity * self._pilots) * back
        return self.correct_by(turned, np.abs(h) ** 2, k, channel.noise)

    def correct_by(
        self, turned: Subcarriers, weight: NDArray[np.float64], k: NDArray[np.int64], no: float
    ) -> float:
        """Correct φ and s by weighted least squares over the angles of the pilots.

        `turned` is the received pilots, rotated back as predicted, times the conjugate of the
        expected ones; `weight` is |Ĥ_p|², `k` are the subcarriers, each `[n]`. The result is the
        noise power on a subcarrier: `no`, or the pilots' own if they disagree by far more.
        """
        total = complex(turned.sum())
        if total == 0:
            return no
        # First the common phase; then the remaining angles are small: arg z ≈ Im z/|z|.
        common = cmath.phase(total)
        aligned = turned * cmath.exp(-1j * common)
        pilots = list(zip(aligned.tolist(), weight.tolist(), k.tolist(), strict=True))
        disagreement = sum(abs(z - w) ** 2 / w for z, w, _ in pilots if w > 0)
        if disagreement > SURPRISE * len(pilots) * no:
            no = disagreement / len(pilots)
        s0, s1, s2 = (sum(w * k**i for _, w, k in pilots) for i in range(3))
        # The sum Σ θ of the weighted angles is 0 by the choice of the common phase.
        t1 = sum(z.imag * k for z, _, k in pilots)
        det = s0 * s2 - s1 * s1
        if not det > 0:
            return no
        self.phase.correct(common - s1 * t1 / det, no / 2 * s2 / det)
        self.slope.correct(s0 * t1 / det, no / 2 * s0 / det)
        return no

    def slip(self, early: int) -> None:
        """Reduce the slope for windows that begin `early` samples earlier."""
        self.slope.value -= early * 2 * np.pi / self._grid.n_fft
