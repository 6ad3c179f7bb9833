"""The whole preamble, re-made with the channel, tells the likeliest frequency offset."""

import numpy as np
from numpy.typing import NDArray

from phy import preamble
from phy.numerology import Numerology
from phy.reference.ofdm import Samples, Subcarriers

BACKOFF = 3
"""FFT windows begin so many samples before the first echo: earlier ones still do no harm."""
FIRST_CLEAN = BACKOFF + 4
"""Before this sample of a short segment, echoes of the segment before it reach into it."""
N_CLEAN = preamble.SEGMENT - 4
PART = 16
"""The phase of so many samples of the long training is looked at as one."""
FREQUENCIES = np.linspace(-0.12, 0.12, 25) / 64
"""These corrections are tried, in cycles a sample."""


def refine(z: Samples, h: Subcarriers, grid: Numerology) -> float:
    """The function returns the likeliest correction of the frequency, in cycles a sample.

        z_i = Σ_m z[t+m] w*[t+m];  f maximises |Σ_i z_i exp(−j2πft_i)|

    `z` begins BACKOFF samples before the preamble and is turned back by the frequency so far; `h`
    `[n_used]` are the gains, from which w, the preamble as it should arrive, is made. Times t_i are
    the middles of the parts. A grid of frequencies is tried; a parabola through the best and its
    neighbours tells what is between them.
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
    """One period of a symbol `[n_fft]` has these subcarriers `[n_used]`."""
    spectrum = np.zeros(grid.n_fft, np.complex128)
    spectrum[grid.bins] = subcarriers
    return np.fft.ifft(spectrum) * grid.scale


def peak_of_parabola(places: NDArray[np.float64], values: NDArray[np.float64]) -> float:
    """The parabola through the largest value and its neighbours has its peak at this place.

    place + (left − right) / 2(left − 2 middle + right) steps, at most one step
    """
    i = min(max(int(values.argmax()), 1), len(values) - 2)
    left, middle, right = values[i - 1 : i + 2]
    bend = left - 2 * middle + right
    shift = 0.5 * (left - right) / bend if bend < 0 else 0.0
    return float(places[i] + np.clip(shift, -1, 1) * (places[1] - places[0]))
