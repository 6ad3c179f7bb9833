"""What every burst begins with: 352 samples that a receiver knows.

Twelve short segments of 16 samples, each the one before times ±1 by the Barker code of length 11
(the cover): DC, a carrier and the plain repetition of 802.11 do not look like it. Then a prefix of
32 samples and twice the long training symbol of 802.11 (IEEE 802.11-2020, 17.3.3).
"""

import numpy as np
from numpy.typing import NDArray

from phy.numerology import OFDM_64_16, Numerology

BARKER = np.array([1, 1, 1, -1, -1, -1, 1, -1, -1, 1, -1], np.float32)
"""Sign of a short segment relative to the one before."""
COVER = np.cumprod(np.concatenate(([1], BARKER))).astype(np.float32)
"""Sign of each short segment `[12]`."""

N_SEGMENTS = len(COVER)
SEGMENT = 16
SHORT = N_SEGMENTS * SEGMENT
GUARD = 32
N_LONG = 2
LENGTH = SHORT + GUARD + N_LONG * 64

_LONG_NEGATIVE = (
    1, 1, -1, -1, 1, 1, -1, 1, -1, 1, 1, 1, 1, 1, 1, -1, -1, 1, 1, -1, 1, -1, 1, 1, 1, 1,
)  # fmt: skip
_LONG_POSITIVE = (
    1, -1, -1, 1, 1, -1, 1, -1, 1, -1, -1, -1, -1, -1, 1, 1, -1, -1, 1, -1, 1, -1, 1, 1, 1, 1,
)  # fmt: skip
LONG_CARRIERS = np.array(_LONG_NEGATIVE + _LONG_POSITIVE, np.float32)
"""The long training symbol on the carriers in use `[52]`."""

# Signs of (1 + j) on the carriers that are multiples of 4.
_SHORT_SIGNS = {
    -24: 1, -20: -1, -16: 1, -12: -1, -8: -1, -4: 1,
    4: -1, 8: -1, 12: 1, 16: 1, 20: 1, 24: 1,
}  # fmt: skip


LONG_TRAINING = np.tile(LONG_CARRIERS.astype(np.complex64), (N_LONG, 1))
"""Both long training symbols as sent `[2, 52]`."""


def short_carriers(grid: Numerology = OFDM_64_16) -> NDArray[np.complex64]:
    """A short segment on the carriers in use, at mean power 1 in time `[n_used]`."""
    values = np.zeros(grid.n_used, np.complex64)
    level = np.sqrt(grid.n_used / len(_SHORT_SIGNS) / 2)
    for k, sign in _SHORT_SIGNS.items():
        values[np.searchsorted(grid.used, k)] = sign * level * (1 + 1j)
    return values


def in_time(carriers: NDArray[np.complex64], grid: Numerology) -> NDArray[np.complex64]:
    """One period of a symbol, without prefix `[n_fft]`."""
    spectrum = np.zeros(grid.n_fft, np.complex128)
    spectrum[grid.bins] = carriers
    return (np.fft.ifft(spectrum) * grid.scale).astype(np.complex64)


def long_symbol(grid: Numerology = OFDM_64_16) -> NDArray[np.complex64]:
    """The long training symbol `[64]`."""
    return in_time(LONG_CARRIERS.astype(np.complex64), grid)


def preamble(grid: Numerology = OFDM_64_16) -> NDArray[np.complex64]:
    """The whole preamble at mean power 1 `[352]`."""
    segment = in_time(short_carriers(grid), grid)[:SEGMENT]
    long = long_symbol(grid)
    short = (COVER[:, None] * segment).reshape(-1)
    return np.concatenate((short, long[-GUARD:], long, long)).astype(np.complex64)
