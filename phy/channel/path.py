"""One burst from antenna to antenna: effects of the transmitter, the echoes and the clocks."""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from phy.channel.fading import BLOCK, jakes, moving_filter
from phy.channel.profiles import PROFILES
from phy.channel.resampling import N_TAPS, echo_filters, stretch

SPIN = 128
"""Samples that share one coarse angle, which saves exponentials."""


@dataclass(frozen=True)
class PathParams:
    """What lies between a transmitter and a receiver: frequencies in Hz, times in s.

    One crystal drives centre frequency and sample rate: at `centre_hz` it shifts both. `image_db`
    and `leak_db` are the transmitter's IQ imbalance and LO leakage below the signal (inf: none).
    `doppler_hz` is the largest shift of an echo, v / c times the centre frequency, on fading
    channels. `phase_noise_dbc_hz` is the phase noise of both oscillators 10 kHz from the centre,
    falling as 1 / f² (-inf: none).
    """

    rate_hz: float
    centre_hz: float = 0.0
    profile: str = "awgn"
    delay_spread_s: float = 100e-9
    loss_db: float = 0.0
    delay_s: float = 0.0
    clock_ppm: float = 0.0
    image_db: float = np.inf
    leak_db: float = np.inf
    doppler_hz: float = 0.0
    phase_noise_dbc_hz: float = -np.inf


class Path:
    """A path from one transmitter to one receiver; fading is drawn anew for each burst."""

    def __init__(self, params: PathParams, rng: Generator) -> None:
        if params.profile not in PROFILES:
            raise ValueError(
                f'channel: got "{params.profile}"; allowed: one of {", ".join(PROFILES)}'
            )
        self._params = params
        self._rng = rng

    @property
    def early(self) -> int:
        """Samples by which a burst may arrive before its index: half the echo filter's length."""
        return 0 if PROFILES[self._params.profile] is None else N_TAPS // 2 - 1

    def carry(self, burst: NDArray[np.complex64]) -> tuple[int, NDArray[np.complex64]]:
        """A burst as it arrives: (its first sample's index relative to the burst's own, samples).

        The burst's phase is random.
        """
        params = self._params
        offset = 0
        x = _imperfect(burst, params.image_db, params.leak_db)
        delay = params.delay_s * params.rate_hz
        error = params.clock_ppm * 1e-6
        whole = int(delay)
        if error or delay != whole:
            x = stretch(x, delay - whole, error)
        offset += whole
        echoes = PROFILES[params.profile]
        if echoes is not None:
            x = self._faded(x, echoes)
            offset -= N_TAPS // 2 - 1
        turn = np.exp(2j * np.pi * self._rng.random()) * 10 ** (-params.loss_db / 20)
        if params.phase_noise_dbc_hz > -np.inf:
            x = x * self._phase_noise(len(x))
        frequency = params.centre_hz * error / params.rate_hz
        if frequency:
            return offset, x * _spin(frequency, turn, len(x))
        return offset, x * np.complex64(turn)

    def _faded(
        self, x: NDArray[np.complex64], echoes: tuple[tuple[float, float], ...]
    ) -> NDArray[np.complex64]:
        params = self._params
        delay, power_db = np.array(echoes).T
        power = 10 ** (power_db / 10)
        scale = np.sqrt(power / power.sum())
        samples = (delay - delay.min()) * params.delay_spread_s * params.rate_hz
        if params.doppler_hz:
            n_blocks = -(-len(x) // BLOCK)
            at = (np.arange(n_blocks, dtype=np.float64) + 0.5) * (BLOCK / params.rate_hz)
            gains = scale * jakes(len(scale), params.doppler_hz, at, self._rng)
            return moving_filter(x, echo_filters(samples, gains))
        draws = self._rng.standard_normal(2 * len(scale)).reshape(2, -1)
        gains = (draws[0] + 1j * draws[1]) * scale / np.sqrt(2)
        return np.convolve(x, echo_filters(samples, gains[None, :])[0])

    def _phase_noise(self, n: int) -> NDArray[np.complex64]:
        """Factors `[n]` of a random-walk phase: L(f) = step² · rate / (2 π f)²."""
        level = 10 ** (self._params.phase_noise_dbc_hz / 10)
        step = 2 * np.pi * 1e4 * np.sqrt(level / self._params.rate_hz)
        walk = np.cumsum(step * self._rng.standard_normal(n))
        return np.exp(1j * walk).astype(np.complex64)


def _spin(frequency: float, first: complex, n: int) -> NDArray[np.complex64]:
    """`first` · exp(2πi `frequency` k) for k = 0 … n − 1, computed as products of two angles."""
    fine = first * np.exp(2j * np.pi * frequency * np.arange(SPIN))
    coarse = np.exp(2j * np.pi * frequency * SPIN * np.arange(-(-n // SPIN)))
    return np.outer(coarse, fine).astype(np.complex64).ravel()[:n]


def _imperfect(
    burst: NDArray[np.complex64], image_db: float, leak_db: float
) -> NDArray[np.complex64]:
    if np.isinf(image_db) and np.isinf(leak_db):
        return burst
    image = np.complex64(10 ** (-image_db / 20))
    power = float(np.mean(burst.real**2 + burst.imag**2))
    leak = np.complex64(np.sqrt(power) * 10 ** (-leak_db / 20))
    return burst + image * burst.conj() + leak
