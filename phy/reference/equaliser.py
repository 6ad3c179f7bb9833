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
    """The likely sent points on the data subcarriers of symbols, decided from the LLRs."""

    mean: Subcarriers
    """E s `[n, n_data]`."""
    square: NDArray[np.float64]
    """E|s|² `[n, n_data]`."""


class Equaliser:
    """Equalises the symbols of one burst in turn, and updates `channel`."""

    def __init__(self, grid: Numerology, channel: Channel, tracking: Tracking) -> None:
        self._grid = grid
        self.channel = channel
        self.tracking = tracking
        self._forget_block()

    def equalise(
        self, y: Subcarriers, number: int, modulation: Modulation
    ) -> tuple[NDArray[np.int16], Subcarriers]:
        """Convert symbols `[n, n_used]` to LLRs in the order of the code, and points.

            u = Y exp(−j(φ + sk)) / Ĥ;  L = |Ĥ|²/N (min_{x: bit 1} |u − x|² − min_{x: bit 0} …)

        LLRs `[n · n_data · bits]` are in eighths, positive for 0; the equalised points are
        `[n, n_data]`. The header's first symbol has number 0; the first one here has `number`, and
        symbols are consecutive.
        """
        done, parts = 0, []
        while done < len(y):
            # With the last symbol of a block the channel changes.
            n = min(len(y) - done, BLOCK - self._n_heard)
            parts.append(self._equalise(y[done : done + n], number + done, modulation))
            done += n
        return np.concatenate([llr for llr, _ in parts]), np.concatenate([u for _, u in parts])

    def _equalise(
        self, y: Subcarriers, number: int, modulation: Modulation
    ) -> tuple[NDArray[np.int16], Subcarriers]:
        """Equalise symbols of one block."""
        grid, signs = self._grid, polarity(len(y), number)
        pilots, no, angle = y[:, grid.pilots_at], np.empty(len(y)), np.empty(y.shape)
        for i, sign in enumerate(signs.tolist()):
            self.tracking.predict()
            no[i] = self.tracking.correct(pilots[i], sign, self.channel)
            angle[i] = self.tracking.angle
        turned = y * np.exp(-1j * angle)
        h = self.channel.h[grid.data_at]
        power = np.abs(h) ** 2
        u = turned[:, grid.data_at] * (h.conj() / (power + 1e-30))
        llr, decided = demap(u, power / no[:, None], modulation)
        self._learn(turned, decided, signs, self.channel.noise / no)
        return deinterleaved(llr, modulation, grid), u

    def _learn(
        self,
        turned: Subcarriers,
        decided: Decided,
        signs: NDArray[np.float32],
        trust: NDArray[np.float64],
    ) -> None:
        """Add symbols to the block's sums: Σ Y (E s)*, Σ E|s|², Σ|E s|².

        Pilots are certain. A symbol with interference counts less: `trust` is N over its own noise.
        """
        grid = self._grid
        mean, square = np.empty(turned.shape, np.complex128), np.empty(turned.shape)
        mean[:, grid.data_at], square[:, grid.data_at] = decided
        mean[:, grid.pilots_at] = signs[:, None] * grid.pilot_values
        square[:, grid.pilots_at] = 1.0
        matched = trust[:, None] * (turned * mean.conj())
        certain = trust * np.sum(np.abs(mean) ** 2, axis=1)
        # One after another, so that it does not matter how many come at once.
        for i in range(len(turned)):
            self._sums += matched[i]
            self._masses += trust[i] * square[i]
            self._certain += float(certain[i])
        self._n_heard += len(turned)
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
    """Convert points `[n, n_data]` to LLRs `[n, n_data · bits]`, and decide what was sent.

    `certainty` `[n, n_data]` is |Ĥ|²/N. Quantised LLRs are eighths, truncated towards 0. BPSK has
    no imaginary axis.
    """
    unit, shape = modulation.unit, u.shape
    weight = (LLR_SCALE * unit**2 * certainty).astype(np.float32).ravel()
    real = (u.real / unit).astype(np.float32).ravel()
    llr = axis_llrs(real, weight, modulation.axis_bits)
    level, square = expected_levels(llr)
    mean = level.astype(np.complex128)
    imaginary_bits = modulation.bits - modulation.axis_bits
    if imaginary_bits:
        imaginary = (u.imag / unit).astype(np.float32).ravel()
        more = axis_llrs(imaginary, weight, imaginary_bits)
        level, more_square = expected_levels(more)
        llr, mean, square = np.concatenate((llr, more)), mean + 1j * level, square + more_square
    decided = Decided(
        (unit * mean).reshape(shape), (unit**2 * square.astype(np.float64)).reshape(shape)
    )
    return llr.T.astype(np.int16).reshape(len(u), -1), decided
