"""Timing: correlates the long training with the sent signal, at each frequency within reach."""

import math
from functools import cache

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from phy import preamble
from phy.numerology import Numerology
from phy.reference.ofdm import Samples

SEARCH = 24
"""The search for the first long symbol covers this many samples around its nominal place."""
MIN_MATCH = 0.12
FIRST_ECHO = 0.1
"""Least power of the first echo, as a share of the strongest echo's power."""
MAX_SPREAD = 12
"""Largest distance in samples from the first echo to the strongest one."""
AMBIGUITY = 1 / 16
"""The peak gives the frequency modulo this, in cycles per sample."""
COHERENT = 64
"""Longest template in samples whose amplitudes may be added; beyond, the frequency is unsure."""
COARSE_ERROR = 0.008
"""Error that noise may add to the frequency of the peak, in cycles per sample."""


@cache
def templates(grid: Numerology, max_frequency: float) -> Samples:
    """The long symbol l, shifted by each multiple a/16 that offsets up to `max_frequency` need.

    The shape is `[2A + 1, n_fft]`, from −A/16 to A/16 cycles per sample.
    """
    reach = (max_frequency + COARSE_ERROR - AMBIGUITY / 2) / AMBIGUITY
    n_aliases = max(0, math.ceil(reach))
    shift = AMBIGUITY * np.arange(-n_aliases, n_aliases + 1)
    turn = np.exp(2j * np.pi * shift[:, None] * np.arange(grid.n_fft))
    return np.asarray(preamble.long_symbol(grid).astype(np.complex128) * turn)


def strengths(z: Samples, shifted: Samples, n_offsets: int) -> NDArray[np.float64]:
    """S `[aliases, n_offsets]`: how well samples match two long symbols from each offset on.

        c[a, o] = Σ_m z[o+m] l*[a, m];  S[a, o] = |c[a, o] + c[a, o+64]|²

    Symbols longer than 64 samples are added by their powers: S = 2|c[a, o]|² + 2|c[a, o+n]|².
    """
    n = shifted.shape[1]
    windows = sliding_window_view(z, n)[: n_offsets + n]
    c = shifted.conj() @ windows.T
    now, later = c[:, :n_offsets], c[:, n : n + n_offsets]
    if n > COHERENT:
        return np.asarray(2 * np.abs(now) ** 2 + 2 * np.abs(later) ** 2)
    return np.asarray(np.abs(now + later) ** 2)


def locate(z: Samples, shifted: Samples) -> tuple[int, float] | None:
    """Find (first sample of the long training, frequency in cycles per sample).

        S > 0.12 · 128 · Σ|y|² over the 128 samples;  f = a/16 + arg Σ_i r_i r*_{i−1} / (2π64)

    r_i is the correlation of the i-th 64 samples. The first sample is that of the first echo. `z`
    is rotated back by the peak's frequency, and begins SEARCH samples before the nominal place.
    None: there is no long training.
    """
    n = shifted.shape[1]
    s = strengths(z, shifted, 2 * SEARCH)
    alias, peak = (int(each) for each in np.unravel_index(s.argmax(), s.shape))
    best, here = s[alias, peak], z[peak : peak + 2 * n]
    if not best > MIN_MATCH * 2 * n * np.sum(np.abs(here) ** 2):
        return None
    earliest = max(0, peak - MAX_SPREAD)
    first_echo = earliest + int(np.argmax(s[alias, earliest:] >= FIRST_ECHO * best))
    match = here * np.tile(shifted[alias].conj(), 2)
    r = match.reshape(-1, COHERENT).sum(axis=1)
    turn = np.angle(np.sum(r[1:] * r[:-1].conj())) / (2 * np.pi * COHERENT)
    return first_echo, (alias - len(shifted) // 2) * AMBIGUITY + float(turn)
