"""Tracking: follows the phase of all subcarriers and its slope over them by two Kalman filters.

The phase changes with the residual offset and the oscillators' noise. The slope grows as the
sender's sampling clock drifts away from ours.
"""

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

_MOVE = np.array([[1.0, 1.0], [0.0, 1.0]])


class Kalman:
    """A Kalman filter with the state (value, rate), one step per symbol."""

    def __init__(self, noise: tuple[float, float], rate: float, rate_deviation: float) -> None:
        self.state = np.array([0.0, rate])
        self.covariance = np.diag([0.0, rate_deviation**2])
        self._noise = np.diag(noise)

    @property
    def value(self) -> float:
        """The value, in radians or radians per subcarrier."""
        return float(self.state[0])

    def predict(self) -> None:
        """Advance by one symbol: x = F x, C = F C Fᵀ + Q, with F = (1 1; 0 1)."""
        self.state = _MOVE @ self.state
        self.covariance = _MOVE @ self.covariance @ _MOVE.T + self._noise

    def correct(self, innovation: float, variance: float) -> None:
        """Correct by a measured deviation: x += K i, C −= K C₀, K = C₀ / (C₀₀ + variance)."""
        first = self.covariance[0]
        gain = first / (first[0] + variance)
        self.state = self.state + gain * innovation
        self.covariance = self.covariance - np.outer(gain, first)


class Tracking:
    """Tracks phase φ and slope s of a burst by its pilots, symbol by symbol.

    `clock_error` is the relative excess of the sender's sampling clock as derived from the centre
    frequency, None if unknown.
    """

    def __init__(self, grid: Numerology, channel: Channel, clock_error: float | None) -> None:
        self._grid = grid
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

    def turned_back(self, y: Subcarriers) -> Subcarriers:
        """Rotate a symbol's subcarriers `[n_used]` back: Y exp(−j(φ + sk))."""
        angle = self.phase.value + self.slope.value * self._grid.used
        return np.asarray(y * np.exp(-1j * angle))

    def correct(self, y: Subcarriers, polarity: float, channel: Channel) -> float:
        """Correct φ and s by a symbol `y` `[n_used]`; returns the noise that its pilots show.

        θ_p = arg(Y_p Ĥ*_p P_p) − φ − s k_p;  S_i = Σ|Ĥ_p|² k_p^i
        Var(φ) = N/2 · S₂ / (S₀S₂ − S₁²),  Var(s) = N/2 · S₀ / (S₀S₂ − S₁²)
        """
        at, pilots = self._grid.pilots_at, polarity * self._grid.pilot_values
        weight = np.abs(channel.h[at]) ** 2
        turned = self.turned_back(y)[at] * channel.h[at].conj() * pilots
        return self.correct_by(turned, weight, self._grid.used[at], channel.noise)

    def correct_by(
        self, turned: Subcarriers, weight: NDArray[np.float64], k: NDArray[np.int64], no: float
    ) -> float:
        """Correct φ and s by weighted least squares over the angles of the pilots.

        `turned` is the received pilots, rotated back as predicted, times the conjugate of the
        expected ones; `weight` is |Ĥ_p|², `k` are the subcarriers, each `[n]`. The result is the
        noise power on a subcarrier: `no`, or the pilots' own if they disagree by far more.
        """
        total = turned.sum()
        if total == 0:
            return no
        # First the common phase; then the remaining angles are small: arg z ≈ Im z/|z|.
        common = float(np.angle(total))
        aligned = turned * np.exp(-1j * common)
        weighted_theta = aligned.imag
        heard = weight > 0
        disagreement = np.sum(np.abs(aligned - weight)[heard] ** 2 / weight[heard])
        if disagreement > SURPRISE * len(turned) * no:
            no = float(disagreement / len(turned))
        s0, s1, s2 = (float(np.sum(weight * k**i)) for i in range(3))
        # The sum Σ θ of the weighted angles is 0 by the choice of the common phase.
        t1 = float(np.sum(weighted_theta * k))
        det = s0 * s2 - s1 * s1
        if not det > 0:
            return no
        self.phase.correct(common - s1 * t1 / det, no / 2 * s2 / det)
        self.slope.correct(s0 * t1 / det, no / 2 * s0 / det)
        return no

    def slip(self, early: int) -> None:
        """Reduce the slope for windows that begin `early` samples earlier."""
        self.slope.state[0] -= early * 2 * np.pi / self._grid.n_fft
