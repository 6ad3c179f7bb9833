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
from phy.reference.smoothing import doubt_more, follow, move_on, scale
from phy.reference.tracking import Shown, Tracking
from phy.sequences import polarity

NO_STEP = 4.0
"""Times the noise by which data may be off behind a step of gain; else others are on the air."""
ODD = 0.25
"""A symbol is of another burst if the noise of the preamble is less than this share of its own."""
LEAST_MASS = 1 / 16
"""With less certainty in the symbols since the last correction of the channel, there is none."""


class Tracked(NamedTuple):
    """A symbol whose pilots were looked at."""

    y: Subcarriers
    kept: NDArray[np.float32]
    no: float
    angle: NDArray[np.float64]
    sign: float


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
        self.trust: list[float] = []
        """Noise of the preamble over that of each symbol of the last call."""
        self._forget_block()

    def equalise(
        self,
        y: Subcarriers,
        number: int,
        modulation: Modulation,
        kept: NDArray[np.float32] | None = None,
        whole: NDArray[np.float32] | None = None,
    ) -> tuple[NDArray[np.int16], Subcarriers]:
        """Convert symbols `[n, n_used]` to LLRs in the order of the code, and points.

            u = Y exp(−j(φ + sk)) / Ĥ;  L = |Ĥ|²/N' (min_{x: bit 1} |u − x|² − min_{x: bit 0} …)

        N' is the noise and the mean variance of Ĥ. LLRs `[n · n_data · bits]` are in eighths,
        positive for 0; the equalised points are `[n, n_data]`. The header's first symbol has number
        0; the first one here has `number`, and symbols are consecutive. Subcarriers with 0 in
        `kept` `[n, n_used]` tell nothing. `whole` `[n]` is the share w of each symbol's samples
        that were not blanked. Such a symbol is scaled up, and has the noise
        (N + (1 − w) mean |H|²) / w.
        """
        rows = np.ones(y.shape, np.float32) if kept is None else kept
        shares = [1.0] * len(y) if whole is None else whole.tolist()
        self.trust = []
        waiting: list[Tracked] = []
        parts = []
        signs = polarity(len(y), number).tolist()
        for part, row, share, sign in zip(y, rows, shares, signs, strict=True):
            if self.channel.moves:
                # The channel moves, so each symbol has its own.
                parts += self._equalise(waiting, modulation)
                self._move_on()
            self.tracking.predict()
            at, each = self._grid.pilots_at, part / share
            known = (self.channel.noise + (1 - share) * self.channel.gain) / share
            shown = self.tracking.correct(each[at], sign, self.channel, row[at], known)
            if shown.movement > 0 or shown.amplitude != 1:
                parts += self._equalise(waiting, modulation)
                self._believe(shown)
            if shown.differ or shown.movement > 0:
                self.channel.due = 1
            tracked = Tracked(each, row, shown.no, self.tracking.angle, sign)
            if shown.amplitude != 1:
                tracked = self._examined(tracked, modulation)
            self.trust.append(self.channel.noise / tracked.no)
            is_odd = known < ODD * tracked.no
            self.channel.n_odd = self.channel.n_odd + 1 if is_odd else 0
            waiting.append(tracked)
            if self._n_heard + len(waiting) >= self.channel.due:
                parts += self._equalise(waiting, modulation)
                self._correct_channel()
        parts += self._equalise(waiting, modulation)
        return np.concatenate([llr for llr, _ in parts]), np.concatenate([u for _, u in parts])

    def _move_on(self) -> None:
        """Move the channel on to the next symbol; what is left of the sums remains the same."""
        self._sums += self.channel.speed * self._masses
        move_on(self.channel, self._grid)

    def _believe(self, shown: Shown) -> None:
        """Change what is known of the channel by what a symbol's pilots show."""
        if shown.amplitude != 1:
            scale(shown.amplitude, self.channel)
            self._sums *= shown.amplitude
        if shown.movement > 0:
            doubt_more(shown.movement, self.channel, self._grid)

    def _examined(self, symbol: Tracked, modulation: Modulation) -> Tracked:
        """Tell a step of gain from another burst, whose pilots look like one, by the data."""
        channel = self.channel
        h = channel.h[self._grid.data_at]
        u = (symbol.y * np.exp(-1j * symbol.angle))[self._grid.data_at] / h
        kept = symbol.kept[self._grid.data_at]
        certainty = kept * np.abs(h) ** 2 / (symbol.no + channel.doubt)
        _, decided = demap(u[None], certainty[None], modulation)
        off = kept * np.abs(h) ** 2 * np.abs(u - decided.mean[0]) ** 2
        share = float(np.mean(off)) / channel.noise
        return symbol._replace(no=share * channel.noise) if share > NO_STEP else symbol

    def _equalise(
        self, waiting: list[Tracked], modulation: Modulation
    ) -> list[tuple[NDArray[np.int16], Subcarriers]]:
        """Equalise the `waiting` symbols, all with the present gains; empties the list."""
        if not waiting:
            return []
        grid, channel = self._grid, self.channel
        y, kept, no, angle, signs = (np.array(each) for each in zip(*waiting, strict=True))
        waiting.clear()
        turned = y * np.exp(-1j * angle)
        h = channel.h[grid.data_at]
        power = np.abs(h) ** 2
        u = turned[:, grid.data_at] * (h.conj() / (power + 1e-30))
        certainty = kept[:, grid.data_at] * power / (no + channel.doubt)[:, None]
        llr, decided = demap(u, certainty, modulation)
        self._learn(turned, decided, signs, kept * (channel.noise / no)[:, None])
        return [(deinterleaved(llr, modulation, grid), u)]

    def _learn(
        self,
        turned: Subcarriers,
        decided: Decided,
        signs: NDArray[np.float32],
        trust: NDArray[np.float64],
    ) -> None:
        """Add symbols to the sums: Σ Y (E s)*, Σ E|s|², Σ|E s|², Σ|Ĥ|² (E|s|² − |E s|²).

        Pilots are certain. A symbol with interference counts less: `trust` `[n, n_used]` is N over
        its own noise, and 0 for subcarriers that were cut.
        """
        grid = self._grid
        mean, square = np.empty(turned.shape, np.complex128), np.empty(turned.shape)
        mean[:, grid.data_at], square[:, grid.data_at] = decided
        mean[:, grid.pilots_at] = signs[:, None] * grid.pilot_values
        square[:, grid.pilots_at] = 1.0
        matched = trust * (turned * mean.conj())
        certain = np.sum(trust * np.abs(mean) ** 2, axis=1)
        power = np.abs(self.channel.h) ** 2
        wrong = np.sum(trust * power * (square - np.abs(mean) ** 2), axis=1)
        # One after another, so that it does not matter how many come at once.
        for i in range(len(turned)):
            self._sums += matched[i]
            self._masses += trust[i] * square[i]
            self._certain += float(certain[i])
            self._wrong += float(wrong[i])
        self._n_heard += len(turned)

    def _correct_channel(self) -> None:
        """Correct gains and speeds by the last symbols: a step of expectation maximisation.

            ΔĤ = (Σ Y (E s)* − Ĥ Σ E|s|²) / Σ|E s|²

        The last sum is averaged over the subcarriers. It is less than Σ E|s|², which lengthens the
        step and compensates the shortening by uncertainty. The error has the variance
        (N + Σ |Ĥ|² (E|s|² − |E s|²) / Σ|E s|²) / Σ|E s|²: a wrong decision disturbs it like noise.
        """
        mass, channel = self._certain / self._grid.n_used, self.channel
        if mass > LEAST_MASS:
            error = (self._sums - channel.h * self._masses) / mass
            noise = channel.noise + max(0.0, self._wrong) / self._certain
            follow(error, noise / mass, self._n_heard, self.tracking.phase, channel, self._grid)
        self._forget_block()

    def _forget_block(self) -> None:
        """Reset the sums for a new block."""
        self._sums = np.zeros(self._grid.n_used, np.complex128)
        self._masses = np.zeros(self._grid.n_used)
        self._certain = self._wrong = 0.0
        self._n_heard = 0


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
