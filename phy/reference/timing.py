"""Timing correlates the long training with what was sent, at each frequency in reach."""

import math
from functools import cache

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from phy import preamble
from phy.numerology import Numerology
from phy.reference.ofdm import Samples

SEARCH = 24
"""The first long symbol is looked for so many samples around where the peak puts it."""
MIN_MATCH = 0.12
FIRST_ECHO = 0.1
"""The first echo is the first one with this share of the strongest's power,"""
MAX_SPREAD = 12
"""at most so many samples before it."""
AMBIGUITY = 1 / 16
"""The peak tells the frequency modulo this, in cycles a sample."""
COHERENT = 64
"""Over more samples than this, the frequency is not known well enough to add amplitudes."""
COARSE_ERROR = 0.008
"""Noise may add so much to the frequency that the peak tells, in cycles a sample."""


@cache
def templates(grid: Numerology, max_frequency: float) -> Samples:
    """The long symbol l is shifted by each multiple a/16 that offsets up to `max_frequency` need.

    The shape is `[2A + 1, n_fft]`, from −A/16 to A/16 cycles a sample.
    """
    reach = (max_frequency + COARSE_ERROR - AMBIGUITY / 2) / AMBIGUITY
    n_aliases = max(0, math.ceil(reach))
    shift = AMBIGUITY * np.arange(-n_aliases, n_aliases + 1)
    turn = np.exp(2j * np.pi * shift[:, None] * np.arange(grid.n_fft))
    return np.asarray(preamble.long_symbol(grid).astype(np.complex128) * turn)


def strengths(z: Samples, shifted: Samples, n_offsets: int) -> NDArray[np.float64]:
    """S `[aliases, n_offsets]` tells how well samples match two long symbols from each offset on.

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
    """The function finds (first sample of the long training, frequency in cycles a sample).

        S > 0.12 · 128 · Σ|y|² over the 128 samples;  f = a/16 + arg Σ_i r_i r*_{i−1} / (2π64)

    r_i is how well the i-th 64 samples match. The first sample is that of the first echo. `z` is
    turned back by what the peak tells, and begins SEARCH samples before the nominal place. None
    says that no long training is there.
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
