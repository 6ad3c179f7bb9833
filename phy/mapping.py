"""Coded bits to the carriers of OFDM symbols: interleaver, constellation, pilots."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from phy import interleaver
from phy.constellation import Modulation, points
from phy.kernels.burst import Axes
from phy.kernels.parcel import Parcel
from phy.kernels.symbols import map_bits
from phy.numerology import Numerology
from phy.sequences import polarity


class Mapping:
    """The tables of one modulation on one grid."""

    def __init__(self, modulation: Modulation, grid: Numerology) -> None:
        self.modulation = modulation
        self.grid = grid
        self.symbol_bits = grid.n_data * modulation.bits
        self.order = interleaver.order(self.symbol_bits, modulation.bits)
        self._points = points(modulation)
        self._data_bins = grid.bins[grid.data_at]
        self._pilot_bins = grid.bins[grid.pilots_at]

    def to_spectrum(self, coded: NDArray[np.uint8], first_symbol: int) -> NDArray[np.complex64]:
        """FFT bins `[n, n_fft]` of coded bits `[n · symbol_bits]`, the header's symbol being 0."""
        n_symbols = len(coded) // self.symbol_bits
        spectrum = np.zeros((n_symbols, self.grid.n_fft), np.complex64)
        map_bits(
            coded,
            self.order,
            self._points,
            self._data_bins,
            self._pilot_bins,
            self.grid.pilot_values,
            polarity(n_symbols, first_symbol),
            spectrum,
        )
        return spectrum


@cache
def mapping(modulation: Modulation, grid: Numerology) -> Mapping:
    """The tables, made once."""
    return Mapping(modulation, grid)


@cache
def axes(modulation: Modulation, grid: Numerology) -> Parcel[Axes]:
    """The way back, as the equaliser wants it."""
    order = mapping(modulation, grid).order
    plane, carrier = order % modulation.bits, order // modulation.bits
    gather = (plane * grid.n_data + carrier).astype(np.uint32)
    imag_bits = modulation.bits - modulation.axis_bits
    return Parcel(Axes(modulation.axis_bits, imag_bits, modulation.unit, gather))
