"""Spreads neighboring coded bits over subcarriers, and over strong and weak bits of a point.

IEEE 802.11-2020, 17.3.5.7, one OFDM symbol at a time.
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray

N_COLUMNS = 16


@cache
def order(n_bits: int, bits_per_subcarrier: int) -> NDArray[np.int32]:
    """Interleaved position of each coded bit of a symbol: bit k goes to `order[k]` `[n_bits]`."""
    s = max(bits_per_subcarrier // 2, 1)
    k = np.arange(n_bits)
    i = n_bits // N_COLUMNS * (k % N_COLUMNS) + k // N_COLUMNS
    j = s * (i // s) + (i + n_bits - N_COLUMNS * i // n_bits) % s
    goes_to: NDArray[np.int32] = j.astype(np.int32)
    return goes_to
