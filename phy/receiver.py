"""The streaming receiver: samples in, PDUs out.

Its states are in `phy/states.py`. Each step waits for the samples it needs. The result for a sample
does not depend on how many came with it: any chunking yields the same events.
"""

import cmath
import math
from collections import Counter
from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from phy import compute, preamble
from phy.acquisition import Acquisition, Missed, before, needed_after
from phy.constellation import Modulation
from phy.cuts import Cuts
from phy.demodulation import Demodulator, PduDecoder
from phy.expected import Expected
from phy.header import n_symbols
from phy.incoming import IncomingBurst
from phy.layout import layout
from phy.numerology import OFDM_64_16, Numerology
from phy.quality import BurstOver, Claim, Event, PduHeard
from phy.screening import Screening
from phy.sizes import SLIP_EVERY
from phy.states import Found, State, after
from phy.stream import SampleStream
from phy.tables.acquisition import BACKOFF
from phy.tables.detector import HISTORY, new_search_memory
from phy.wariness import THRESHOLD, Wariness

HOP = 512
ALIGN_SPAN = preamble.SHORT
PLAINEST = 0.7
"""A peak at least this strong without the preamble's code is not a preamble."""
# Number of samples after a false alarm at which the search continues.
RETRY_AFTER = 16
# Maximum number of samples processed at once, to limit memory on large calls.
PIECE = 1 << 16


class Receiver:
    """Finds bursts in a stream and decodes them. Not thread-safe.

    `max_frequency` is the largest frequency offset expected, in cycles per sample. Bursts of other
    networks than `network` are reported but not decoded; None accepts all. `centre_cycles` is the
    centre frequency in cycles per sample, if senders derive centre frequency and sample rate from
    one crystal: then the frequency offset also gives the error of the sampling clock. 0: unknown.
    `on_points` gets the equalised points `[n, n_data]` of payload symbols, for plots; it may be set
    later, too. `expected` bounds what headers may claim; None believes all. `cuts` may be set to
    what an excisor takes out of the samples.
    """

    def __init__(
        self,
        network: int | None = 0,
        max_frequency: float = 0.02,
        grid: Numerology = OFDM_64_16,
        start: int = 0,
        centre_cycles: float = 0.0,
        on_points: Callable[[NDArray[np.complex64], Modulation], None] | None = None,
        expected: Expected | None = None,
    ) -> None:
        self._screening = Screening(network, expected, start)
        self._grid = grid
        self.on_points = on_points
        self._acquisition = Acquisition(grid, max_frequency, centre_cycles)
        self._demodulator = Demodulator(grid)
        self.cuts: Cuts | None = None
        self._n_marked = 0
        self._powers = np.empty(SLIP_EVERY, np.float32)
        self._decoder = PduDecoder()
        self._n_header = n_symbols(grid)
        self._memory = new_search_memory(HOP)
        # The samples that acquisition needs: how many before the peak, and how many in total.
        self._before = before(grid) - 1 - preamble.guard(grid)
        self._span = before(grid) + needed_after(grid)
        # Samples before the search position that acquisition still needs.
        self._kept = before(grid) + preamble.SHORT + HISTORY
        self._stream = SampleStream(start, 1 << 16)
        self._state = State.SEARCH
        self._steps: Mapping[State, Callable[[list[Event]], bool]] = {
            State.SEARCH: self._search,
            State.ALIGN: self._align,
            State.ACQUIRE: self._acquire,
            State.PAYLOAD: self._payload,
        }
        # What is known in the present state about the current burst.
        self._burst: IncomingBurst | None = None
        self._crossing, self._peak, self._coarse = start, start, 0.0
        self._wariness = Wariness(start)
        self._at = self._began = start
        self.claim = Claim(start, start)
        """The air that the last header claims."""
        self.counters: Counter[str] = Counter()
        self._begin(start)

    @property
    def next_index(self) -> int:
        """Absolute index of the next sample to push."""
        return self._stream.end

    def push(self, samples: NDArray[np.complex64]) -> list[Event]:
        """Take the next samples `[n]`, complex64; returns the events that they complete."""
        events: list[Event] = []
        for first in range(0, len(samples), PIECE):
            piece = samples[first : first + PIECE]
            self.counters["samples_bad"] += self._stream.append(piece)
            self.counters["samples"] += len(piece)
            while self._steps[self._state](events):
                pass
            self._stream.forget_before(self._at - self._kept)
        return events

    def gap(self, n: int) -> list[Event]:
        """Note that `n` samples are missing: the current burst ends, the search restarts."""
        if n < 0:
            raise ValueError(f"gap: got {n} samples; allowed: 0 or more")
        self.counters["gaps"] += 1
        end = self._stream.end
        events: list[Event] = []
        if self._burst is not None:
            self._end(self._burst, events, "cut")
        elif end > self._at:
            events = self.flush()
        self._go(Found.CUT)
        self._begin(end + n)
        return events

    def flush(self) -> list[Event]:
        """End the stream; returns the events in its last samples, as if silence followed."""
        n = self._grid.n_symbol + HOP + ALIGN_SPAN + needed_after(self._grid)
        samples, self._began = self.counters["samples"], self._stream.end + n
        known = self._memory.content.state.copy()
        events = self.push(np.zeros(n, np.complex64))
        self.counters["samples"] = samples
        # Silence that nobody received tells nothing of the noise.
        self._memory.content.state[:] = known
        if self._burst is not None:
            self._end(self._burst, events, "cut")
            self._go(Found.CUT)
        return events

    def _begin(self, index: int) -> None:
        """Start the search at `index`, with silence before it."""
        self._stream.restart(index - self._kept)
        self._stream.append(np.zeros(self._kept, np.complex64))
        self._at = self._began = index

    def _go(self, found: Found) -> None:
        """Enter the state that follows what was found."""
        self._state = after(self._state, found)

    def _pass_by(self, peak: int, counter: str, found: Found) -> None:
        """Search on right behind a peak that is not followed."""
        self.counters[counter] += 1
        self._go(found)
        self._at = peak + RETRY_AFTER

    # One step for each state; returns False when it needs more samples.

    def _search(self, _: list[Event]) -> bool:
        """Slide the metric over whole hops of samples, up to the first crossing."""
        n_hops = (self._stream.end - self._at) // HOP
        if n_hops < 1:
            return False
        first = self._at - HISTORY
        x = self._stream.view(first, self._at + n_hops * HOP)
        wary, age = self._wariness.excess, self._at - self._wariness.raised_at
        found = compute.search(x, n_hops, HOP, THRESHOLD, wary, age, self._memory)
        if found < 0:
            self._at += n_hops * HOP
        else:
            self.counters["triggers"] += 1
            self._at = self._crossing = first + found
            self._go(Found.CROSSING)
        return True

    def _align(self, _: list[Event]) -> bool:
        """Find the metric's maximum within a preamble's length of the first crossing."""
        crossing = self._crossing
        if self._stream.end < crossing + ALIGN_SPAN:
            return False
        x = self._stream.view(crossing - HISTORY, crossing + ALIGN_SPAN)
        offset, p, plain = compute.strongest(x, ALIGN_SPAN, self._memory)
        self._peak = self._at = crossing + offset
        if plain > PLAINEST:
            self._was_nothing(self._peak)
        elif not self._screening.allows(self._peak):
            self._pass_by(self._peak, "peaks_skipped", Found.NOTHING)
        else:
            self._coarse = cmath.phase(p) / (2 * math.pi * preamble.SEGMENT)
            self._go(Found.PEAK)
        return True

    def _was_nothing(self, peak: int) -> None:
        """Search on after a false alarm, with a raised threshold: its source may return."""
        self._go(Found.NOTHING)
        self._at = peak + RETRY_AFTER
        # The first samples of noise after silence resemble anything.
        if peak >= self._began + preamble.SHORT:
            self._wariness.false_alarm(peak)

    def _acquire(self, events: list[Event]) -> bool:
        """Read training and header of the burst at the preamble's peak."""
        peak = self._peak
        base = peak - self._before
        if self._stream.end < base + self._span:
            return False
        x = self._stream.view(base, base + self._span)
        if self.cuts is not None:
            known = np.arange(base + before(self._grid), base + self._span, self._grid.n_fft)
            self._mark(self.cuts.kept(known, self._coarse, self._grid), self._n_header)
        found = self._acquisition.acquire(x, base, self._coarse, self._dc_value)
        self.counters["preambles"] += not isinstance(found, Missed) or found.stage != "preamble"
        if isinstance(found, Missed):
            self._screening.missed()
            if found.stage == "preamble":
                self._was_nothing(peak)
            else:
                self._pass_by(peak, "headers_bad", Found.BAD_HEADER)
            return True
        self._memory.content.heard(found.quality.noise)
        told = found.header
        plan = layout(self._grid, told.mcs, told.n_pdus, told.pdu_bytes)
        if self._screening.refuses(told, plan):
            self._screening.missed()
            self._pass_by(peak, "headers_refused", Found.BAD_HEADER)
            return True
        burst = self._burst = IncomingBurst(found, plan, self._grid)
        self.claim = self._screening.claim(found.quality, burst.end_of(plan.n_symbols) + BACKOFF)
        if self._screening.is_foreign(told):
            # The search continues in the burst: a false header must not make the receiver deaf.
            self._end(burst, events, "foreign")
            self._go(Found.FOREIGN)
        else:
            self._decoder.start(plan)
            self._go(Found.HEADER)
            self.counters["bursts"] += 1
            self._at = found.window
        return True

    def _payload(self, events: list[Event]) -> bool:
        """Decode the symbols that complete PDUs, or the symbols up to the next window slip."""
        burst = self._burst
        if burst is None or self._stream.end < burst.next_end:
            return False
        plan, found, first = burst.plan, burst.acquired, burst.n_symbols_in
        last, n_pdus = burst.complete(self._stream.end)
        begin, n = burst.window(first), last - first
        if self.cuts is not None:
            starts = begin + self._grid.n_symbol * np.arange(n)
            self._mark(self.cuts.kept(starts, found.frequency, self._grid))
        points, on_points = None, self.on_points
        if on_points is not None:
            points = np.empty((n, self._grid.n_data), np.complex64)
        self._demodulator.demodulate(
            self._stream.view(begin, burst.end_of(last)),
            found.frequency,
            self._dc_value,
            begin - found.origin,
            plan.mcs.modulation,
            found.channel,
            self._n_header + first,
            self._decoder.room(n),
            self._powers,
            points,
        )
        if on_points is not None and points is not None:
            on_points(points, plan.mcs.modulation)
        for data in self._decoder.decode(n_pdus):
            number = burst.n_good + burst.n_bad
            through = plan.symbols_through(number + 1)
            if data is not None:
                burst.n_good += 1
                self.counters["pdus_good"] += 1
                at, is_last = burst.end_of(through) + BACKOFF, number + 1 == plan.n_pdus
                events.append(
                    PduHeard(data, number, at, found.quality, burst.doppler if is_last else None)
                )
            else:
                burst.n_bad += 1
                self.counters["pdus_bad"] += 1
                own = self._powers[max(0, burst.n_symbols_in - first) : through - first]
                if number + 1 < plan.n_pdus and burst.is_gone(own):
                    burst.n_symbols_in = through
                    self._end(burst, events, "faded")
                    self._go(Found.OVER)
                    return True
            burst.n_symbols_in = through
        burst.n_symbols_in = last
        self._at = burst.end_of(last)
        if burst.n_good + burst.n_bad == plan.n_pdus:
            self._end(burst, events, "whole")
            self._go(Found.OVER)
        else:
            burst.go_on()
            self._go(Found.PDUS)
        return True

    def _mark(self, kept: NDArray[np.float32] | None, n_alike: int = 0) -> None:
        """Tell the kernels which subcarriers to leave out of the next symbols.

        `kept` has a row for each symbol, or what all of `n_alike` have in common.
        """
        rows = self._acquisition.kept
        rows[: self._n_marked] = 1
        self._n_marked = 0 if kept is None else n_alike or len(kept)
        if kept is not None:
            of_tones = kept[:, self._grid.tones]
            rows[: self._n_marked, : self._grid.n_used] = of_tones.min(0) if n_alike else of_tones

    def _end(self, burst: IncomingBurst, events: list[Event], ending: str) -> None:
        self._burst = None
        if ending != "whole":
            self.counters[f"bursts_{ending}"] += 1
        if ending == "faded":
            end = burst.end_of(burst.n_symbols_in) + BACKOFF
            self.claim = self._screening.claim(burst.acquired.quality, end)
        if not burst.n_good:
            self._screening.missed()
        events.append(BurstOver(burst.acquired.quality, burst.n_good, ending))
        self._at = burst.end_of(burst.n_symbols_in)

    @property
    def _dc_value(self) -> complex:
        return self._memory.content.dc
