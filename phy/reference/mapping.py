"""Mapping from coded bits to subcarriers: interleaver, constellation, pilots.

The way back is in `equaliser` and `demapper`; only `deinterleaved` is here, beside its inverse.
"""

import numpy as np
from numpy.typing import NDArray

from phy.constellation import Modulation, points
from phy.interleaver import order
from phy.numerology import Numerology
from phy.sequences import polarity

Bits = NDArray[np.uint8]


def to_points(coded: Bits, modulation: Modulation, grid: Numerology) -> NDArray[np.complex128]:
    """Map coded bits `[n · n_data · bits]` to the points of the data subcarriers `[n, n_data]`.

    Bit k of a symbol moves to position `order[k]`; each group of `bits` positions is the number of
    a point, first bit highest (IEEE 802.11-2020, 17.3.5.7 and 17.3.5.8).
    """
    n_bits = grid.n_data * modulation.bits
    placed = np.empty((len(coded) // n_bits, n_bits), np.int64)
    placed[:, order(n_bits, modulation.bits)] = coded.reshape(-1, n_bits)
    weights = 1 << np.arange(modulation.bits)[::-1]
    numbers = placed.reshape(-1, grid.n_data, modulation.bits) @ weights
    return points(modulation)[numbers].astype(np.complex128)


def to_subcarriers(
    coded: Bits, modulation: Modulation, grid: Numerology, first_symbol: int
) -> NDArray[np.complex128]:
    """Map coded bits to whole symbols `[n, n_used]`: points, and pilots with their polarity.

        X_k = a point on a data subcarrier, p_i P_k on a pilot

    The header's first symbol has number 0; the first one here has number `first_symbol`.
    """
    data = to_points(coded, modulation, grid)
    subcarriers = np.empty((len(data), grid.n_used), np.complex128)
    subcarriers[:, grid.data_at] = data
    signs = polarity(len(data), first_symbol)
    subcarriers[:, grid.pilots_at] = signs[:, None] * grid.pilot_values
    return subcarriers


def deinterleaved(
    placed: NDArray[np.int16], modulation: Modulation, grid: Numerology
) -> NDArray[np.int16]:
    """Put the values of symbols' positions `[n, n_data · bits]` into the order of the code."""
    return placed[:, order(grid.n_data * modulation.bits, modulation.bits)].ravel()
