"""Maps coded bits to samples of OFDM symbols: interleaver, constellation, pilots, inverse FFT."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from phy import compute, interleaver
from phy.constellation import Modulation, points
from phy.estimation import tones
from phy.numerology import Numerology
from phy.sequences import PADDING
from phy.tables.block import ArgumentBlock
from phy.tables.burst import Axes
from phy.tables.code import Form
from phy.tables.mapping import Map


class Mapping:
    """Maps coded bits to samples, with one modulation on one grid."""

    def __init__(self, modulation: Modulation, grid: Numerology) -> None:
        self.grid = grid
        self.symbol_bits = grid.n_data * modulation.bits
        self.order = interleaver.order(self.symbol_bits, modulation.bits)
        table = points(modulation)
        self._map = ArgumentBlock(
            Map(
                bits=modulation.bits,
                source=np.argsort(self.order).astype(np.uint32),
                real=table.real.copy(),
                imag=table.imag.copy(),
            )
        )

    def to_samples(
        self, coded: NDArray[np.uint8], first_symbol: int, peak: float
    ) -> NDArray[np.complex64]:
        """Samples `[n · n_symbol]` of coded bits `[n · symbol_bits]`, at mean power 1.

        The first symbol has number `first_symbol`; the header's first symbol is 0. No magnitude
        exceeds `peak`.
        """
        grid = self.grid
        out = np.empty(len(coded) // self.symbol_bits * grid.n_symbol, np.complex64)
        compute.modulate_bits(coded, first_symbol, peak, tones(grid), self._map, out)
        return out

    def modulate(
        self,
        blocks: NDArray[np.uint8],
        n_blocks: int,
        form: ArgumentBlock[Form],
        first_symbol: int,
        peak: float,
        out: NDArray[np.complex64],
    ) -> None:
        """Write `n_blocks` blocks of bytes, coded by `form`, to `out` as samples of whole symbols.

        The first symbol has number `first_symbol`; the header's first symbol is 0. No magnitude
        exceeds `peak`.
        """
        coded = np.empty(len(out) // self.grid.n_symbol * self.symbol_bits, np.uint8)
        compute.modulate(
            blocks, n_blocks, PADDING, first_symbol, peak,
            form, tones(self.grid), self._map, coded, out,
        )  # fmt: skip


@cache
def mapping(modulation: Modulation, grid: Numerology) -> Mapping:
    """The `Mapping` of a modulation on a grid, created once."""
    return Mapping(modulation, grid)


@cache
def axes(modulation: Modulation, grid: Numerology) -> ArgumentBlock[Axes]:
    """The equaliser's tables for the way from points back to coded bits."""
    order = mapping(modulation, grid).order
    plane, subcarrier = order % modulation.bits, order // modulation.bits
    gather = (plane * grid.n_data + subcarrier).astype(np.uint32)
    imag_bits = modulation.bits - modulation.axis_bits
    return ArgumentBlock(Axes(modulation.axis_bits, imag_bits, modulation.unit, gather))
