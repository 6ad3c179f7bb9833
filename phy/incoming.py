"""State of a burst while it is being received."""

import math

import numpy as np
from numpy.typing import NDArray

from phy import compute
from phy.acquisition import Acquired
from phy.estimation import tones
from phy.layout import BurstLayout
from phy.numerology import Numerology
from phy.sizes import SLIP_EVERY
from phy.tables.burst import N_FOLLOWED, SLOPE, TURNS

SEEMING = 5e-6
"""Squared turn in rad² that phase noise and clocks make still echoes seem to have in a symbol."""

# When a PDU fails and the power above the noise is below this share of the burst's, the burst has
# ended.
_FADED = 0.25


class IncomingBurst:
    """A burst being received: the position of its symbols, and how many PDUs are decoded."""

    def __init__(self, acquired: Acquired, plan: BurstLayout, grid: Numerology) -> None:
        self.acquired = acquired
        self.plan = plan
        self.n_symbols_in = self.n_good = self.n_bad = 0
        self._grid = grid
        self._n_symbol, self._n_cp = grid.n_symbol, grid.n_cp
        self._window = acquired.window
        self._limit = SLIP_EVERY
        self.next_end = 0
        """Absolute index that the stream must reach before the burst can go on."""
        self._look_ahead()

    def window(self, symbol: int) -> int:
        """Absolute index at which the FFT of payload symbol `symbol` begins."""
        return self._window + symbol * self._n_symbol

    def end_of(self, n: int) -> int:
        """Absolute index after the FFT windows of the first `n` payload symbols."""
        return self._window + n * self._n_symbol - self._n_cp

    def complete(self, end: int) -> tuple[int, int]:
        """(total symbols to process, PDUs that they complete) when the stream reaches `end`."""
        plan, done = self.plan, self.n_good + self.n_bad
        here = min((end - self.end_of(0)) // self._n_symbol, plan.n_symbols, self._limit)
        n_pdus = min(here * plan.symbol_bits // plan.coded_bits, plan.n_pdus) - done
        # At the limit all symbols are processed, even those of an incomplete PDU: the windows slip
        # there.
        return (here if here == self._limit else plan.symbols_through(done + n_pdus)), n_pdus

    def is_gone(self, powers: NDArray[np.float32]) -> bool:
        """Whether the burst has ended, by the `powers` of the symbols of a PDU that failed."""
        channel = self.acquired.channel.content
        return len(powers) > 0 and bool(powers.mean() < channel.no + _FADED * channel.gain)

    @property
    def doppler(self) -> float:
        """Doppler of the echoes so far, in cycles per sample."""
        figures = self.acquired.channel.content.figures
        turns = float(figures[TURNS]) / max(1.0, float(figures[N_FOLLOWED])) - SEEMING
        return math.sqrt(max(0.0, turns)) / (2 * math.pi * self._n_symbol)

    def go_on(self) -> None:
        """Prepare for the next symbols; slip the windows if that is due."""
        if self.n_symbols_in == self._limit:
            self._limit += SLIP_EVERY
            self._slip()
        self._look_ahead()

    def _look_ahead(self) -> None:
        through = self.plan.symbols_through(self.n_good + self.n_bad + 1)
        self.next_end = self.end_of(min(through, self._limit))

    def _slip(self) -> None:
        """Move the FFT windows by whole samples, according to the slope over the subcarriers."""
        channel, grid = self.acquired.channel, self._grid
        slope = float(channel.content.tracking[SLOPE, 0])
        early = round(slope * grid.n_fft / (2 * math.pi))
        if early:
            self._window -= early
            compute.slip(early, tones(grid), channel)
