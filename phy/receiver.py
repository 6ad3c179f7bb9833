"""The streaming receiver: samples in, PDUs out.

SEARCH → ALIGN → ACQUIRE → PAYLOAD. Every step waits until the samples it needs are there, and what
it makes of a sample does not depend on how many came with it: any chunking yields the same events.
"""

import cmath
import math
from collections import Counter
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from phy import ofdm, preamble
from phy.acquisition import BEFORE, Acquired, Acquisition, Missed, needed_after
from phy.constellation import Modulation
from phy.demodulation import Demodulator, PduDecoder
from phy.header import N_NETWORKS, N_SYMBOLS
from phy.incoming import IncomingBurst
from phy.kernels.detector import HISTORY, search, strongest
from phy.layout import layout
from phy.ldpc import LdpcWorkspace
from phy.numerology import OFDM_64_16, Numerology
from phy.quality import BurstOver, Event, PduHeard
from phy.stream import SampleStream

HOP = 512
ALIGN_SPAN = preamble.SHORT
THRESHOLD = 0.25
# After a false alarm, the search goes on so many samples later.
RETRY_AFTER = 16
PIECE = 1 << 13
# Kept for acquisition before the sample at which the search stands.
_KEPT = BEFORE + preamble.SHORT + HISTORY
# A PDU fails with less than this share of the burst's power above the noise: the burst is gone.
_FADED = 0.25
# Every so many payload symbols, the FFT windows follow the sender's clock.
SLIP_EVERY = 256


class Receiver:
    """Finds bursts in a stream and decodes them. Not for several threads at once.

    `max_frequency` is the largest carrier offset expected, in cycles a sample. Bursts of other
    networks than `network` are told but not decoded; None takes all. `on_points` gets the
    equalised points `[n, n_data]` of payload symbols, for pictures.
    """

    def __init__(
        self,
        network: int | None = 0,
        max_frequency: float = 0.02,
        grid: Numerology = OFDM_64_16,
        start: int = 0,
        on_points: Callable[[NDArray[np.complex64], Modulation], None] | None = None,
    ) -> None:
        if network is not None and not 0 <= network < N_NETWORKS:
            raise ValueError(f"network: got {network}; allowed: 0 to {N_NETWORKS - 1}")
        self._network = network
        self._grid = grid
        self._on_points = on_points
        self._acquisition = Acquisition(grid, max_frequency)
        self._demodulators = {each: Demodulator(each, grid) for each in Modulation}
        self._workspace = LdpcWorkspace()
        self._work = np.zeros((7, HISTORY + HOP), np.float32)
        self._dc = np.zeros(3)
        self._stream = SampleStream(start, 1 << 16)
        self._burst: IncomingBurst | None = None
        self._crossing: int | None = None
        self._peak: tuple[int, float] | None = None
        self._at = start
        self.carrier = (start, start)
        """Where the last burst of which the header was read begins, and where it should end."""
        self.counters: Counter[str] = Counter()
        self._begin(start)

    @property
    def next_index(self) -> int:
        """Absolute index of the next sample to push."""
        return self._stream.end

    def push(self, samples: NDArray[np.complex64]) -> list[Event]:
        """Take the next samples `[n]`, complex64; what they complete."""
        events: list[Event] = []
        for first in range(0, len(samples), PIECE):
            piece = samples[first : first + PIECE]
            self.counters["samples_bad"] += self._stream.append(piece)
            self.counters["samples"] += len(piece)
            while self._step(events):
                pass
            self._stream.forget_before(self._at - _KEPT)
        return events

    def gap(self, n: int) -> list[Event]:
        """`n` samples are missing here: a burst they cut is over, the search begins behind them."""
        if n < 0:
            raise ValueError(f"gap: got {n} samples; allowed: 0 or more")
        self.counters["gaps"] += 1
        end = self._stream.end
        events: list[Event] = []
        if self._burst is not None:
            self._end(self._burst, events, "cut")
        elif end > self._at:
            events = self.flush()
        self._begin(end + n)
        return events

    def flush(self) -> list[Event]:
        """The stream has ended: what its last samples hold, as if silence followed."""
        n = self._grid.n_symbol + HOP + ALIGN_SPAN + needed_after(self._grid)
        samples = self.counters["samples"]
        events = self.push(np.zeros(n, np.complex64))
        self.counters["samples"] = samples
        if self._burst is not None:
            self._end(self._burst, events, "cut")
        return events

    def _begin(self, index: int) -> None:
        """Search from `index`, with silence before it."""
        self._crossing = self._peak = None
        self._stream.restart(index - _KEPT)
        self._stream.append(np.zeros(_KEPT, np.complex64))
        self._at = index

    def _step(self, events: list[Event]) -> bool:
        """Go one step on; False when samples are missing for it."""
        if self._burst is not None:
            return self._payload(self._burst, events)
        if self._peak is not None:
            return self._acquire(*self._peak, events)
        if self._crossing is not None:
            return self._align(self._crossing)
        return self._search()

    def _search(self) -> bool:
        n_hops = (self._stream.end - self._at) // HOP
        if n_hops < 1:
            return False
        first = self._at - HISTORY
        x = self._stream.view(first, self._at + n_hops * HOP)
        found = search(x, n_hops, HOP, THRESHOLD, self._dc, self._work)
        if found < 0:
            self._at += n_hops * HOP
        else:
            self.counters["triggers"] += 1
            self._at = self._crossing = first + found
        return True

    def _align(self, crossing: int) -> bool:
        """The metric's maximum within a preamble's length of the first crossing."""
        if self._stream.end < crossing + ALIGN_SPAN:
            return False
        x = self._stream.view(crossing - HISTORY, crossing + ALIGN_SPAN)
        peak, p = strongest(x, ALIGN_SPAN, self._dc_value, self._work)
        turn = cmath.phase(p) / (2 * math.pi * preamble.SEGMENT)
        self._at = crossing + peak
        self._crossing, self._peak = None, (crossing + peak, turn)
        return True

    def _acquire(self, peak: int, coarse: float, events: list[Event]) -> bool:
        nominal = peak + 1 + preamble.GUARD
        if self._stream.end < nominal + needed_after(self._grid):
            return False
        base = nominal - BEFORE
        x = self._stream.view(base, nominal + needed_after(self._grid))
        found = self._acquisition.acquire(x, base, coarse, self._dc_value)
        self._peak = None
        if isinstance(found, Missed):
            self._at = peak + RETRY_AFTER
            if found.stage == "header":
                self.counters["preambles"] += 1
                self.counters["headers_bad"] += 1
            return True
        self.counters["preambles"] += 1
        told = found.header
        plan = layout(self._grid, told.mcs, told.n_pdus, told.pdu_bytes)
        self._burst = IncomingBurst(
            found,
            PduDecoder(plan, self._workspace),
            self._demodulators[plan.mcs.modulation],
            self._grid.n_symbol,
        )
        end = self._burst.window(plan.n_symbols) - self._grid.n_cp
        self.carrier = (found.quality.start, end)
        if self._network is not None and told.network != self._network:
            # Searched on, not skipped: a header that lies must not make us deaf.
            self._end(self._burst, events, "foreign")
        else:
            self.counters["bursts"] += 1
            self._at = found.window
        return True

    def _payload(self, burst: IncomingBurst, events: list[Event]) -> bool:
        """The symbols that complete PDUs, or those up to where the windows may slip."""
        plan, found = burst.decoder.layout, burst.acquired
        first_symbol = burst.n_symbols_in
        last, n_pdus = self._complete(burst)
        if last == first_symbol:
            return False
        first = burst.window(first_symbol)
        starts = self._grid.n_symbol * np.arange(last - first_symbol)
        bins = ofdm.to_bins(
            self._stream.view(first, burst.window(last) - self._grid.n_cp),
            starts,
            found.frequency,
            self._dc_value,
            self._grid,
            self._since(burst, first),
        )
        llr, points = burst.demodulator.demap(
            bins, found.channel, found.tracking, N_SYMBOLS + first_symbol
        )
        if self._on_points is not None:
            self._on_points(points, plan.mcs.modulation)
        for data in burst.decoder.decode(llr, n_pdus):
            number = burst.n_good + burst.n_bad
            through = plan.symbols_through(number + 1)
            own = bins[max(0, burst.n_symbols_in - first_symbol) : through - first_symbol]
            burst.n_symbols_in = through
            if data is not None:
                burst.n_good += 1
                self.counters["pdus_good"] += 1
                end = burst.window(through) - self._grid.n_cp
                events.append(PduHeard(data, number, end, found.quality))
                continue
            burst.n_bad += 1
            self.counters["pdus_bad"] += 1
            if number + 1 < plan.n_pdus and self._is_gone(own, found):
                self._end(burst, events, "faded")
                return True
        burst.n_symbols_in = last
        self._at = burst.window(last) - self._grid.n_cp
        if burst.n_good + burst.n_bad == plan.n_pdus:
            self._end(burst, events, "whole")
        elif last % SLIP_EVERY == 0:
            burst.slip(self._grid)
        return True

    def _complete(self, burst: IncomingBurst) -> tuple[int, int]:
        """(symbols to take in all, PDUs they complete), with the samples that are there."""
        plan, grid = burst.decoder.layout, self._grid
        here = (self._stream.end - burst.window(0) + grid.n_cp) // grid.n_symbol
        here = min(here, plan.n_symbols)
        limit = (burst.n_symbols_in // SLIP_EVERY + 1) * SLIP_EVERY
        done = burst.n_good + burst.n_bad
        n_pdus = min(min(here, limit) * plan.symbol_bits // plan.coded_bits, plan.n_pdus) - done
        if here >= limit:
            return limit, n_pdus
        return (plan.symbols_through(done + n_pdus), n_pdus) if n_pdus else (burst.n_symbols_in, 0)

    def _since(self, burst: IncomingBurst, index: int) -> int:
        """Samples from the channel estimate's window to `index`."""
        grid = self._grid
        head = preamble.N_LONG * grid.n_fft + N_SYMBOLS * grid.n_symbol + grid.n_cp
        return index - (burst.acquired.window - head)

    def _is_gone(self, bins: NDArray[np.complex64], found: Acquired) -> bool:
        used = bins[:, self._grid.bins]
        if not len(used):
            return False
        power = float(np.mean(used.real**2 + used.imag**2))
        return power < found.channel.no + _FADED * found.channel.gain

    def _end(self, burst: IncomingBurst, events: list[Event], ending: str) -> None:
        self._burst = None
        if ending != "whole":
            self.counters[f"bursts_{ending}"] += 1
        events.append(BurstOver(burst.acquired.quality, burst.n_good, ending))
        self._at = burst.window(burst.n_symbols_in) - self._grid.n_cp

    @property
    def _dc_value(self) -> complex:
        return complex(self._dc[0], self._dc[1])
