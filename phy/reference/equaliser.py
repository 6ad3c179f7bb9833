"""Equaliser: turns a symbol's subcarriers into LLRs, and learns the channel from its decisions."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from phy.constellation import Modulation
from phy.numerology import Numerology
from phy.reference.channel import Channel
from phy.reference.demapper import LLR_SCALE, axis_llrs, expected_levels
from phy.reference.mapping import deinterleaved
from phy.reference.ofdm import Subcarriers
from phy.reference.smoothing import follow
from phy.reference.tracking import Tracking
from phy.sequences import polarity

BLOCK = 8
"""Number of symbols after which the channel is corrected."""
LEAST_MASS = BLOCK / 4
"""Least certainty in a block; with less, others were on the air and the block is not used."""


class Decided(NamedTuple):
    """The likely sent points on the data subcarriers of a symbol, decided from the LLRs."""

    mean: Subcarriers
    """E s `[n_data]`."""
    square: NDArray[np.float64]
    """E|s|² `[n_data]`."""


class Equaliser:
    """Equalises one burst symbol by symbol, and updates `channel`."""

    def __init__(self, grid: Numerology, channel: Channel, tracking: Tracking) -> None:
        self._grid = grid
        self.channel = channel
        self.tracking = tracking
        self._forget_block()

    def equalise(
        self, y: Subcarriers, number: int, modulation: Modulation
    ) -> tuple[NDArray[np.int16], Subcarriers]:
        """Convert a symbol `[n_used]` to LLRs in the order of the code, and points.

            u = Y exp(−j(φ + sk)) / Ĥ;  L = |Ĥ|²/N (min_{x: bit 1} |u − x|² − min_{x: bit 0} …)

        LLRs `[n_data · bits]` are in eighths, positive for 0; the equalised points are `[n_data]`.
        The header's first symbol has `number` 0, and symbols are consecutive.
        """
        sign = float(polarity(1, number)[0])
        self.tracking.predict()
        no = self.tracking.correct(y, sign, self.channel)
        turned = self.tracking.turned_back(y)
        data = self._grid.data_at
        h = self.channel.h[data]
        u = turned[data] * h.conj() / (np.abs(h) ** 2 + 1e-30)
        llr, decided = demap(u, np.abs(h) ** 2 / no, modulation)
        self._learn(turned, decided, sign, self.channel.noise / no)
        return deinterleaved(llr, modulation, self._grid), u

    def _learn(self, turned: Subcarriers, decided: Decided, sign: float, trust: float) -> None:
        """Add a symbol to the block's sums: Σ Y (E s)*, Σ E|s|², Σ|E s|².

        Pilots are certain. A symbol with interference counts less: `trust` is N over its own noise.
        """
        grid = self._grid
        mean, square = np.empty(grid.n_used, np.complex128), np.empty(grid.n_used)
        mean[grid.data_at], square[grid.data_at] = decided
        mean[grid.pilots_at], square[grid.pilots_at] = sign * grid.pilot_values, 1.0
        self._sums += trust * turned * mean.conj()
        self._masses += trust * square
        self._certain += trust * float(np.sum(np.abs(mean) ** 2))
        self._n_heard += 1
        if self._n_heard == BLOCK:
            self._correct_channel()

    def _correct_channel(self) -> None:
        """Correct the gains after a block of symbols: a step of expectation maximisation.

            ΔĤ = (Σ Y (E s)* − Ĥ Σ E|s|²) / Σ|E s|²

        The last sum is averaged over the subcarriers. It is less than Σ E|s|², which lengthens the
        step and compensates the shortening by uncertainty. The error has the noise N / Σ|E s|².
        """
        mass = self._certain / self._grid.n_used
        if mass > LEAST_MASS:
            error = (self._sums - self.channel.h * self._masses) / mass
            follow(error, self.channel.noise / mass, self.channel, self._grid)
        self._forget_block()

    def _forget_block(self) -> None:
        """Reset the sums for a new block."""
        self._sums = np.zeros(self._grid.n_used, np.complex128)
        self._masses = np.zeros(self._grid.n_used)
        self._certain, self._n_heard = 0.0, 0


def demap(
    u: Subcarriers, certainty: NDArray[np.float64], modulation: Modulation
) -> tuple[NDArray[np.int16], Decided]:
    """Convert points `[n]` to LLRs `[n · bits]`, and decide what was sent.

    `certainty` `[n]` is |Ĥ|²/N. Quantised LLRs are eighths, truncated towards 0. BPSK has no
    imaginary axis.
    """
    unit = modulation.unit
    weight = (LLR_SCALE * certainty * unit**2).astype(np.float32)
    real = (u.real / unit).astype(np.float32)
    llr = axis_llrs(real, weight, modulation.axis_bits)
    level, square = expected_levels(llr)
    mean = level.astype(np.complex128)
    imaginary_bits = modulation.bits - modulation.axis_bits
    if imaginary_bits:
        imaginary = (u.imag / unit).astype(np.float32)
        more = axis_llrs(imaginary, weight, imaginary_bits)
        level, more_square = expected_levels(more)
        llr, mean, square = np.concatenate((llr, more)), mean + 1j * level, square + more_square
    decided = Decided(unit * mean, unit**2 * square.astype(np.float64))
    return llr.T.reshape(-1).astype(np.int16), decided
