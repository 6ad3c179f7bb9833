"""Where a burst begins and how far its carrier is off.

1. The detector's peak P gives the frequency modulo 1/16 cycles a sample.
2. The long training symbol is correlated for every multiple of 1/16 within reach: the best tells
   the frequency, and the first strong echo the timing.
3. The phase between the two long training symbols, 64 samples apart.
4. All of the preamble, re-made from a first channel estimate: the most likely frequency.
"""

import cmath
import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from phy import preamble
from phy.estimation import BACKOFF
from phy.kernels.training import (
    correlate,
    energy,
    lag_product,
    likelihood,
    match_blocks,
    transform,
)
from phy.numerology import Numerology

SEARCH = 24
"""The first long symbol is looked for this many samples around where the peak puts it."""
MIN_MATCH = 0.12
FIRST_ECHO = 0.1
MAX_SPREAD = 12

_AMBIGUITY = 1 / preamble.SEGMENT
# What noise may add to the offset that the peak tells.
_COARSE_ERROR = 0.008
# Samples of a short segment that echoes of the one before hardly reach.
_FIRST_CLEAN = BACKOFF + 4
_N_CLEAN = preamble.SEGMENT - 4
_BLOCK = 16
_FINE_GRID = np.linspace(-0.12, 0.12, 25) / 64


class Timing(NamedTuple):
    """First sample of the first long symbol's first echo, and frequency in cycles a sample."""

    long_start: int
    frequency: float


def n_aliases(max_frequency: float) -> int:
    """Multiples of 1/16 to try on either side for offsets up to `max_frequency`."""
    return max(0, math.ceil((max_frequency + _COARSE_ERROR - _AMBIGUITY / 2) / _AMBIGUITY))


def locate(
    x: NDArray[np.complex64], nominal: int, coarse: float, aliases: int, grid: Numerology
) -> Timing | None:
    """Find the long training symbols near `nominal` in `x`; None when they are not there.

    `x` must reach SEARCH samples before `nominal` and SEARCH + 128 after; its DC is taken off.
    """
    n = grid.n_fft
    first = nominal - SEARCH
    span = x[first : nominal + SEARCH + 2 * n]
    strength = np.empty((2 * aliases + 1, 2 * SEARCH), np.float32)
    correlate(span, coarse, _templates(grid, aliases), strength)
    alias, peak = divmod(int(strength.argmax()), 2 * SEARCH)
    found = strength[alias]
    if not found[peak] > MIN_MATCH * 2 * n * energy(span[peak : peak + 2 * n]):
        return None
    echoes = found[max(0, peak - MAX_SPREAD) : peak + 1]
    early = peak + 1 - len(echoes) + int(np.argmax(echoes >= FIRST_ECHO * echoes[-1]))
    frequency = coarse + (alias - aliases) * _AMBIGUITY
    lag = lag_product(span[early:], n)
    rest = cmath.phase(lag * cmath.exp(-2j * math.pi * frequency * n))
    return Timing(first + early, frequency + rest / (2 * math.pi * n))


def refine(
    x: NDArray[np.complex64], timing: Timing, h_hat: NDArray[np.complex64], grid: Numerology
) -> float:
    """The most likely frequency, over the short and the long training, in cycles a sample.

    `h_hat` is a first estimate for windows that begin BACKOFF before `timing.long_start`.
    """
    tables = _fine_tables(grid)
    blocks = np.empty(len(tables.centres), np.complex128)
    match_blocks(
        x[timing.long_start - BACKOFF - preamble.GUARD - preamble.SHORT :],
        timing.frequency,
        transform(tables.short, h_hat),
        preamble.COVER,
        _FIRST_CLEAN,
        _N_CLEAN,
        transform(tables.long, h_hat),
        preamble.SHORT + preamble.GUARD,
        _BLOCK,
        blocks,
    )
    likely = np.empty(len(_FINE_GRID))
    likelihood(tables.turns, blocks, likely)
    return timing.frequency + _peak_of_parabola(_FINE_GRID, likely)


@lru_cache(maxsize=8)
def _templates(grid: Numerology, aliases: int) -> NDArray[np.complex64]:
    """The long symbol, shifted by each multiple of 1/16 `[2 aliases + 1, 64]`."""
    time = np.arange(grid.n_fft)
    shift = np.exp(2j * np.pi * _AMBIGUITY * np.arange(-aliases, aliases + 1)[:, None] * time)
    templates: NDArray[np.complex64] = (preamble.long_symbol(grid) * shift).astype(np.complex64)
    return templates


class _FineTables(NamedTuple):
    short: NDArray[np.complex64]
    """Channel to a short segment in time `[16, n_used]`."""
    long: NDArray[np.complex64]
    """Channel to a long symbol in time `[n_fft, n_used]`."""
    centres: NDArray[np.float64]
    turns: NDArray[np.complex128]
    """Blocks turned back by each frequency of the grid `[25, n_blocks]`."""


@lru_cache(maxsize=4)
def _fine_tables(grid: Numerology) -> _FineTables:
    time = np.arange(grid.n_fft)[:, None]
    inverse = np.exp(2j * np.pi * grid.used * time / grid.n_fft) * (grid.scale / grid.n_fft)
    short = inverse[: preamble.SEGMENT] * preamble.short_carriers(grid)
    clean = _FIRST_CLEAN + (_N_CLEAN - 1) / 2
    segments = preamble.SEGMENT * np.arange(preamble.N_SEGMENTS) + clean
    n_long = preamble.N_LONG * grid.n_fft // _BLOCK
    blocks = preamble.SHORT + preamble.GUARD + _BLOCK * np.arange(n_long) + (_BLOCK - 1) / 2
    centres = np.concatenate((segments, blocks))
    return _FineTables(
        short.astype(np.complex64),
        (inverse * preamble.LONG_CARRIERS).astype(np.complex64),
        centres,
        np.exp(-2j * np.pi * _FINE_GRID[:, None] * centres),
    )


def _peak_of_parabola(grid: NDArray[np.float64], values: NDArray[np.float64]) -> float:
    """Where the parabola through the largest value and its neighbours has its peak."""
    i = min(max(int(values.argmax()), 1), len(values) - 2)
    left, middle, right = float(values[i - 1]), float(values[i]), float(values[i + 1])
    bend = left - 2 * middle + right
    shift = 0.5 * (left - right) / bend if bend < 0 else 0.0
    return float(grid[i]) + min(max(shift, -1.0), 1.0) * float(grid[1] - grid[0])
