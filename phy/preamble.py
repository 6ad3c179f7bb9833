"""The preamble of every burst, known to every receiver: 352 samples on a grid of 64 subcarriers.

It begins with twelve short segments of 16 samples. Each is the previous one times ±1, according to
the Barker code of length 11 (the cover), which distinguishes them from DC, a tone and the plain
repetition of 802.11. A prefix and two long training symbols follow; on 64 subcarriers they are
those of 802.11 (IEEE 802.11-2020, 17.3.3).
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from phy.numerology import OFDM_64_16, Numerology
from phy.sequences import lfsr

BARKER = np.array([1, 1, 1, -1, -1, -1, 1, -1, -1, 1, -1], np.float32)
"""Sign of a short segment relative to the one before."""
COVER = np.cumprod(np.concatenate(([1], BARKER))).astype(np.float32)
"""Sign of each short segment `[12]`."""

N_SEGMENTS = len(COVER)
SEGMENT = 16
SHORT = N_SEGMENTS * SEGMENT
N_LONG = 2

_LONG_NEGATIVE = (
    1, 1, -1, -1, 1, 1, -1, 1, -1, 1, 1, 1, 1, 1, 1, -1, -1, 1, 1, -1, 1, -1, 1, 1, 1, 1,
)  # fmt: skip
_LONG_POSITIVE = (
    1, -1, -1, 1, 1, -1, 1, -1, 1, -1, -1, -1, -1, -1, 1, 1, -1, -1, 1, -1, 1, -1, 1, 1, 1, 1,
)  # fmt: skip
# Start states of the register of x^9 + x^5 + 1, chosen for the lowest peaks.
_LONG_SEEDS = {128: 293, 256: 246}

# Signs of (1 + j) on the subcarriers that are multiples of 4, of 64.
_SHORT_SIGNS = {
    -24: 1, -20: -1, -16: 1, -12: -1, -8: -1, -4: 1,
    4: -1, 8: -1, 12: 1, 16: 1, 20: 1, 24: 1,
}  # fmt: skip


def guard(grid: Numerology = OFDM_64_16) -> int:
    """Length in samples of the prefix before the long training symbols."""
    return max(32, 2 * grid.n_cp)


def long_start(grid: Numerology = OFDM_64_16) -> int:
    """Number of samples before the first long training symbol."""
    return SHORT + guard(grid)


def length(grid: Numerology = OFDM_64_16) -> int:
    """Length in samples of the whole preamble."""
    return long_start(grid) + N_LONG * grid.n_fft


@cache
def long_subcarriers(grid: Numerology = OFDM_64_16) -> NDArray[np.float32]:
    """The long training symbol on the subcarriers in use, ±1 `[n_used]`."""
    if grid.n_fft == OFDM_64_16.n_fft:
        return np.array(_LONG_NEGATIVE + _LONG_POSITIVE, np.float32)
    return 1 - 2 * lfsr((5, 9), _LONG_SEEDS[grid.n_fft], grid.n_used).astype(np.float32)


def short_subcarriers(grid: Numerology = OFDM_64_16) -> NDArray[np.complex64]:
    """A short segment on the subcarriers in use `[n_used]`, at mean power 1 in time.

    In time it is the same on every grid.
    """
    values = np.zeros(grid.n_used, np.complex64)
    level = np.sqrt(grid.n_used / len(_SHORT_SIGNS) / 2)
    for k, sign in _SHORT_SIGNS.items():
        values[np.searchsorted(grid.used, k * grid.n_fft // 64)] = sign * level * (1 + 1j)
    return values


def in_time(subcarriers: NDArray[np.complex64], grid: Numerology) -> NDArray[np.complex64]:
    """One period of a symbol in time `[n_fft]`, without a prefix."""
    spectrum = np.zeros(grid.n_fft, np.complex128)
    spectrum[grid.bins] = subcarriers
    return (np.fft.ifft(spectrum) * grid.scale).astype(np.complex64)


def long_symbol(grid: Numerology = OFDM_64_16) -> NDArray[np.complex64]:
    """The long training symbol in time `[n_fft]`, without a prefix."""
    return in_time(long_subcarriers(grid).astype(np.complex64), grid)


def preamble(grid: Numerology = OFDM_64_16) -> NDArray[np.complex64]:
    """The whole preamble at mean power 1 `[length(grid)]`."""
    segment = in_time(short_subcarriers(grid), grid)[:SEGMENT]
    long = long_symbol(grid)
    short = (COVER[:, None] * segment).reshape(-1)
    return np.concatenate((short, long[-guard(grid) :], long, long)).astype(np.complex64)
