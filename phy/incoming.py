"""State of a burst while it is being received."""

import math
from collections import deque
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from phy import compute, header
from phy.acquisition import Acquired, Acquisition
from phy.constellation import Modulation
from phy.cuts import Cuts
from phy.demodulation import Demodulator, PduDecoder
from phy.estimation import tones
from phy.layout import BurstLayout
from phy.numerology import Numerology
from phy.quality import snr_of_llrs
from phy.sizes import SLIP_EVERY
from phy.stream import SampleStream
from phy.tables.burst import GAIN, N_FOLLOWED, N_ODD, NO, SLOPE, TURNS

OnPoints = Callable[[NDArray[np.complex64], Modulation], None]
SEEMING = 5e-6
"""Squared turn in rad² that phase noise and clocks make still echoes seem to have in a symbol."""

# When a PDU fails and the power above the noise is below this share of the burst's, the burst has
# ended.
_FADED = 0.25
# A symbol with so many times the burst's power has another burst in it.
_LOUD = 2.0
# So many symbols at the end of a burst may be of another one before the search looks there.
_MOST_ODD = 2
BACK = 511
"""A good PDU may outlive the begin of another burst in so many of its last samples."""


class Place:
    """What one burst needs for itself from its header on: a channel, and room for its LLRs."""

    def __init__(self, grid: Numerology, max_frequency: float, centre_cycles: float) -> None:
        self.acquisition = Acquisition(grid, max_frequency, centre_cycles)
        self.decoder = PduDecoder()
        self.n_header = header.n_symbols(grid)


Decoded = tuple[bytes | None, int, int, bool, float]
"""A PDU whose symbols are in, or None if its CRC-32 is wrong; absolute indices; whether it is gone;
the SNR of its LLRs.

The indices are that after its last symbol; and the one where the power begins to be more than the
burst's, or again the end. It is gone if it lacks the power of the burst.
"""


class IncomingBurst:
    """A burst being received: the position of its symbols, and which PDUs are decoded."""

    def __init__(
        self, place: Place, acquired: Acquired, plan: BurstLayout, grid: Numerology, dc: complex
    ) -> None:
        self.place = place
        self.acquired = acquired
        self.plan = plan
        self.n_symbols_in = self.n_good = self.n_bad = 0
        self.decoded: deque[Decoded] = deque()
        """PDUs that do not count yet as good or bad."""
        self.judged = acquired.window
        """Absolute index after the last PDU that counts."""
        place.decoder.start(plan)
        self._grid = grid
        # What the search takes for DC from now on may be of another burst.
        self._dc = dc
        self._n_symbol, self._n_cp = grid.n_symbol, grid.n_cp
        self._window = acquired.window
        self._limit = SLIP_EVERY
        self._figures = figures = acquired.channel.content.figures
        self._loud = _LOUD * float(figures[GAIN] + figures[NO])
        self._next_end = self._end_of(min(plan.symbols_through(1), SLIP_EVERY))

    @property
    def need(self) -> int:
        """Absolute index that the stream must reach before the burst can go on."""
        return self.decoded[0][1] if self.decoded else self._next_end

    @property
    def at(self) -> int:
        """Absolute index of the first sample that it still needs."""
        return self._window + self.n_symbols_in * self._n_symbol

    @property
    def end(self) -> int:
        """Absolute index after its last symbol, by its header."""
        return self._end_of(self.plan.n_symbols)

    def take(
        self,
        stream: SampleStream,
        demodulator: Demodulator,
        powers: NDArray[np.float32],
        hidden: NDArray[np.float64],
        cuts: Cuts | None,
        on_points: OnPoints | None,
    ) -> None:
        """Decode the PDUs that are complete, or take the symbols up to the next window slip."""
        plan, found, first = self.plan, self.acquired, self.n_symbols_in
        last, n_pdus = self._complete(stream.end)
        begin, n = self.at, last - first
        if cuts is not None:
            starts = begin + self._n_symbol * np.arange(n)
            kept = cuts.kept(starts, found.frequency, self._grid)
            self.place.acquisition.leave_out(kept, cuts.whole(starts, self._grid))
        points = None
        if on_points is not None:
            points = np.empty((n, self._grid.n_data), np.complex64)
        loudest = demodulator.demodulate(
            stream.view(begin, self._end_of(last)),
            found.frequency,
            self._dc,
            begin - found.origin,
            plan.mcs.modulation,
            found.channel,
            self.place.n_header + first,
            self.place.decoder.room(n),
            powers,
            hidden,
            points,
        )
        if on_points is not None and points is not None:
            on_points(points, plan.mcs.modulation)
        number, own_from = self.n_good + self.n_bad, first
        is_loud, snr_db, hid = loudest > self._loud, found.quality.snr_db, 0.0
        for data in self.place.decoder.decode(n_pdus):
            number += 1
            through = plan.symbols_through(number)
            end = plain_until = self._end_of(through)
            is_gone = False
            if number < plan.n_pdus:
                is_gone = data is None and self._lacks_power(
                    powers[own_from - first : through - first]
                )
            elif self._figures[N_ODD] > _MOST_ODD:
                plain_until = end - BACK
            if is_loud:
                loud = np.flatnonzero(powers[own_from - first : through - first] > self._loud)
                if len(loud):
                    plain_until = min(plain_until, self._end_of(own_from + int(loud[0]) - 1))
            if through > own_from:
                before, hid = hid, hidden.item(through - first - 1)
                snr_db = snr_of_llrs(found.quality.snr_db, (hid - before) / (through - own_from))
            self.decoded.append((data, end, plain_until, is_gone, snr_db))
            own_from = through
        self.n_symbols_in = last
        if last == self._limit:
            self._limit += SLIP_EVERY
            self._slip()
        if number < plan.n_pdus:
            self._next_end = self._end_of(min(plan.symbols_through(number + 1), self._limit))

    @property
    def doppler(self) -> float:
        """Doppler of the echoes so far, in cycles per sample."""
        figures = self._figures
        turns = float(figures[TURNS]) / max(1.0, float(figures[N_FOLLOWED])) - SEEMING
        return math.sqrt(max(0.0, turns)) / (2 * math.pi * self._n_symbol)

    def _end_of(self, n: int) -> int:
        """Absolute index after the FFT windows of the first `n` payload symbols."""
        return self._window + n * self._n_symbol - self._n_cp

    def _complete(self, end: int) -> tuple[int, int]:
        """(total symbols to process, PDUs that they complete) when the stream reaches `end`."""
        plan, done = self.plan, self.n_good + self.n_bad
        here = min((end - self._end_of(0)) // self._n_symbol, plan.n_symbols, self._limit)
        n_pdus = min(here * plan.symbol_bits // plan.coded_bits, plan.n_pdus) - done
        # At the limit all symbols are processed, even those of an incomplete PDU: the windows slip
        # there.
        return (here if here == self._limit else plan.symbols_through(done + n_pdus)), n_pdus

    def _lacks_power(self, powers: NDArray[np.float32]) -> bool:
        """Whether the burst has ended, by the `powers` of the symbols of a PDU that failed."""
        least = self._figures[NO] + _FADED * self._figures[GAIN]
        return len(powers) > 0 and bool(powers.mean() < least)

    def _slip(self) -> None:
        """Move the FFT windows by whole samples, according to the slope over the subcarriers."""
        channel, grid = self.acquired.channel, self._grid
        slope = float(channel.content.tracking[SLOPE, 0])
        early = round(slope * grid.n_fft / (2 * math.pi))
        if early:
            self._window -= early
            compute.slip(early, tones(grid), channel)
