"""Frequency offset: the most likely one, from the whole preamble rebuilt with the channel."""

import numpy as np
from numpy.typing import NDArray

from phy import preamble
from phy.numerology import Numerology
from phy.reference.ofdm import Samples, Subcarriers

BACKOFF = 3
"""Samples before the first echo at which FFT windows begin: slightly earlier echoes do no harm."""
FIRST_CLEAN = BACKOFF + 4
"""First sample of a short segment that echoes of the previous segment do not reach."""
N_CLEAN = preamble.SEGMENT - 4
PART = 16
"""Number of samples of the long training whose phase is evaluated together."""
FREQUENCIES = np.linspace(-0.12, 0.12, 25) / 64
"""Frequency corrections to try, in cycles per sample."""


def refine(z: Samples, h: Subcarriers, grid: Numerology) -> float:
    """Find the most likely correction of the frequency, in cycles per sample.

        z_i = Σ_m z[t+m] w*[t+m];  f maximises |Σ_i z_i exp(−j2πft_i)|

    `z` begins BACKOFF samples before the preamble and is rotated back by the frequency so far; `h`
    `[n_used]` are the gains, from which w, the expected preamble, is made. Times t_i are the
    middles of the parts. A grid of frequencies is tried; a parabola through the best one and its
    neighbors finds the maximum in between.
    """
    short = _in_time(h * preamble.short_subcarriers(grid), grid)[: preamble.SEGMENT]
    long = _in_time(h * preamble.long_subcarriers(grid), grid)
    parts, times = [], []
    for s, sign in enumerate(preamble.COVER):
        at = preamble.SEGMENT * s + FIRST_CLEAN + np.arange(N_CLEAN)
        parts.append(sign * np.sum(z[at] * short[at % preamble.SEGMENT].conj()))
        times.append(at.mean())
    for p in range(0, preamble.N_LONG * grid.n_fft, PART):
        at = p + np.arange(PART)
        parts.append(np.sum(z[preamble.long_start(grid) + at] * long[at % grid.n_fft].conj()))
        times.append(preamble.long_start(grid) + at.mean())
    turns = np.exp(-2j * np.pi * FREQUENCIES[:, None] * np.array(times))
    return peak_of_parabola(FREQUENCIES, np.abs(turns @ np.array(parts)) ** 2)


def _in_time(subcarriers: Subcarriers, grid: Numerology) -> Samples:
    """One period of a symbol `[n_fft]` with these subcarriers `[n_used]`."""
    spectrum = np.zeros(grid.n_fft, np.complex128)
    spectrum[grid.bins] = subcarriers
    return np.fft.ifft(spectrum) * grid.scale


def peak_of_parabola(places: NDArray[np.float64], values: NDArray[np.float64]) -> float:
    """Position of the peak of the parabola through the largest value and its neighbors.

    place + (left − right) / 2(left − 2 middle + right) steps, at most one step
    """
    i = min(max(int(values.argmax()), 1), len(values) - 2)
    left, middle, right = values[i - 1 : i + 2]
    bend = left - 2 * middle + right
    shift = 0.5 * (left - right) / bend if bend < 0 else 0.0
    return float(places[i] + np.clip(shift, -1, 1) * (places[1] - places[0]))
