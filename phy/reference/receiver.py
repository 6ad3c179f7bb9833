"""Receiver: takes a stream of samples and reports PDUs, in the order of "What is received".

SEARCH → ALIGN → ACQUIRE → PAYLOAD. Each state waits for the samples it needs. The result for a
sample never depends on how many came with it: any chunking yields the same events.
"""

from collections import Counter
from collections.abc import Callable
from copy import copy

import numpy as np
from numpy.typing import NDArray

from phy import preamble
from phy.constellation import Modulation
from phy.cuts import Cuts
from phy.expected import Expected
from phy.header import n_symbols
from phy.layout import layout
from phy.numerology import OFDM_64_16, Numerology
from phy.quality import BurstOver, Claim, Event, PduHeard
from phy.reference.acquisition import Acquisition, Missed, before, needed_after
from phy.reference.detection import HISTORY, HOP, Detector
from phy.reference.offset import BACKOFF
from phy.reference.payload import BACK, Payload
from phy.screening import Screening

ALIGN_SPAN = preamble.SHORT
"""Number of samples from the first crossing on in which the peak must lie."""
MOST_BURSTS = 2
"""A burst that begins in another one is received beside it; a third takes the worse one's place."""
RETRY_AFTER = 16
"""Number of samples after a false alarm at which the search continues."""
LARGEST_SAMPLE = 1e6
"""Larger values are errors and count as 0, as do values that are not finite."""


class Receiver:
    """Finds bursts in a stream and decodes them; has the same interface as `phy.Receiver`.

    `max_frequency` is the largest frequency offset expected, in cycles per sample. Bursts of other
    networks than `network` are reported but not decoded; None accepts all. `centre_cycles` is the
    centre frequency in cycles per sample, for senders with one crystal; 0: unknown. `on_points`
    gets the equalised points `[n, n_data]`. `expected` bounds what headers may claim; None believes
    all. Raises ValueError for an impossible network.
    """

    # The samples kept, and the absolute index of the first one.
    _samples: NDArray[np.complex64]
    _first: int
    # Absolute indices of the search position, and of the start of the search.
    _at: int
    _began: int

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
        self._on_points = on_points
        self._acquisition = Acquisition(grid, max_frequency, centre_cycles)
        self._detector = Detector(start)
        # Distance from the first sample for acquisition to the peak.
        self._before = before(grid) - 1 - preamble.guard(grid)
        self._span = before(grid) + needed_after(grid)
        # Number of samples before the search position that acquisition and detection need.
        self._kept = before(grid) + preamble.SHORT + HISTORY
        # Bursts in progress, by the order of their headers; good PDUs that the search leaves out.
        self._bursts: list[Payload] = []
        self._explained: list[tuple[int, int]] = []
        self._crossing: int | None = None
        self._peak: tuple[int, float] | None = None
        self.claim = Claim(start, start)
        """The air that the last header claims."""
        self.cuts: Cuts | None = None
        self.counters: Counter[str] = Counter()
        self._begin(start)

    @property
    def next_index(self) -> int:
        """Absolute index of the next sample to push."""
        return self._first + len(self._samples)

    def push(self, samples: NDArray[np.complex64]) -> list[Event]:
        """Take the next samples `[n]`; returns the events that they complete."""
        x = np.array(samples, np.complex64)
        with np.errstate(invalid="ignore"):
            good = (np.abs(x.real) < LARGEST_SAMPLE) & (np.abs(x.imag) < LARGEST_SAMPLE)
        x[~good] = 0
        self.counters["samples_bad"] += int(np.count_nonzero(~good))
        self.counters["samples"] += len(x)
        self._samples = np.concatenate((self._samples, x))
        events: list[Event] = []
        while self._step(events):
            pass
        # Samples long before the search position are no longer needed.
        needed = [burst.window(burst.n_symbols_in) for burst in self._bursts]
        n_old = max(0, min([self._at - self._kept, *needed]) - self._first)
        self._samples, self._first = self._samples[n_old:], self._first + n_old
        return events

    def gap(self, n: int) -> list[Event]:
        """Note that `n` samples are missing: the current burst ends, the search restarts."""
        if n < 0:
            raise ValueError(f"gap: got {n} samples; allowed: 0 or more")
        self.counters["gaps"] += 1
        end = self.next_index
        events: list[Event] = []
        if self._bursts:
            self._cut(events)
        elif end > self._at:
            events = self.flush()
        self._begin(end + n)
        return events

    def flush(self) -> list[Event]:
        """End the stream; returns the events in its last samples, as if silence followed."""
        n = self._grid.n_symbol + HOP + ALIGN_SPAN + needed_after(self._grid)
        counted, self._began = self.counters["samples"], self.next_index + n
        known = copy(self._detector)
        events = self.push(np.zeros(n, np.complex64))
        self.counters["samples"] = counted
        # Silence that nobody received tells nothing of the noise.
        self._detector = known
        self._cut(events)
        return events

    def _cut(self, events: list[Event]) -> None:
        while self._bursts:
            self._end(self._bursts[0], events, "cut")

    def _begin(self, index: int) -> None:
        """Start the search at `index`, with silence before it."""
        self._crossing = self._peak = None
        self._explained = []
        self._samples = np.zeros(self._kept, np.complex64)
        self._first = index - self._kept
        self._at = self._began = index

    def _view(self, first: int, last: int) -> NDArray[np.complex64] | None:
        """The samples from `first` to before `last`, or None if some are missing."""
        if last > self.next_index:
            return None
        return self._samples[first - self._first : last - self._first]

    def _step(self, events: list[Event]) -> bool:
        """Take the step that needs the fewest samples; returns False if they are missing."""
        burst = min(self._bursts, key=lambda each: each.need, default=None)
        if self._peak is not None:
            needed = self._peak[0] - self._before + self._span
            if burst is None or needed <= burst.need:
                return self._acquire(*self._peak, events)
        elif self._crossing is not None:
            if burst is None or self._crossing + ALIGN_SPAN <= burst.need:
                return self._align(self._crossing)
        elif self._search():
            return True
        return burst is not None and self._payload(burst, events)

    def _search(self) -> bool:
        """Search a hop for the first sample above the threshold."""
        # The bound moves the position, too.
        if self._searchable() < self._at + HOP:
            return False
        x = self._view(self._at - HISTORY, self._at + HOP)
        if x is None:
            return False
        begin = self._at
        self._crossing = self._detector.crossing(x, self._at)
        if self._crossing is None:
            self._at += HOP
        else:
            self.counters["triggers"] += 1
            self._at = self._crossing
        if self._bursts:
            self.counters["samples_searched_again"] += self._at - begin
        return True

    def _searchable(self) -> int:
        """The index before which all is there to search: what no good PDU explains."""
        while self._explained:
            begin, end = self._explained[0]
            if self._at + HOP <= begin:
                return begin
            self._at = max(self._at, end)
            self._explained.pop(0)
        return self._bursts[-1].judged if self._bursts else self.next_index

    def _align(self, crossing: int) -> bool:
        """Find the metric's maximum within a short training's length of the crossing."""
        x = self._view(crossing - HISTORY, crossing + ALIGN_SPAN)
        if x is None:
            return False
        offset, frequency = self._detector.strongest(x)
        peak = self._at = crossing + offset
        self._crossing = None
        if frequency is None:
            self._was_nothing(peak)
        elif not self._screening.allows(peak):
            self._pass_by(peak, "peaks_skipped")
        else:
            self._peak = (peak, frequency)
        return True

    def _was_nothing(self, peak: int) -> None:
        """Continue the search after a false alarm, with a raised threshold."""
        self._at = peak + RETRY_AFTER
        # The first samples of noise after silence resemble anything.
        if peak >= self._began + preamble.SHORT:
            self._detector.was_nothing(peak)

    def _acquire(self, peak: int, coarse: float, events: list[Event]) -> bool:
        """Read a burst's header, if there is one."""
        base = peak - self._before
        x = self._view(base, base + self._span)
        if x is None:
            return False
        found = self._acquisition.acquire(x, base, coarse, self._detector.dc, self.cuts)
        self._peak = None
        self.counters["preambles"] += not isinstance(found, Missed) or found.stage != "preamble"
        if isinstance(found, Missed):
            self._screening.missed()
            if found.stage == "preamble":
                self._was_nothing(peak)
            else:
                self._pass_by(peak, "headers_bad")
            return True
        self._detector.heard(found.quality.noise)
        told = found.header
        plan = layout(self._grid, told.mcs, told.n_pdus, told.pdu_bytes)
        if self._screening.refuses(told, plan):
            self._screening.missed()
            self._pass_by(peak, "headers_refused")
            return True
        burst = Payload(found, plan, self._grid, n_symbols(self._grid), self._detector.dc)
        claim = self._screening.claim(found.quality, burst.end_of(plan.n_symbols) + BACKOFF)
        if not self._bursts or claim.end > self.claim.end:
            self.claim = claim
        if self._screening.is_foreign(told):
            # The search continues in the burst: a false header must not make the receiver deaf.
            self.counters["bursts_foreign"] += 1
            self._screening.missed()
            events.append(BurstOver(found.quality, 0, "foreign"))
            self._at = burst.end_of(0)
            return True
        self.counters["bursts"] += 1
        self.counters["captures"] += len(self._bursts) > 0
        if len(self._bursts) == MOST_BURSTS:
            self._end(min(self._bursts, key=lambda each: each.n_good), events, "displaced")
        self._bursts.append(burst)
        self._at = found.window
        return True

    def _pass_by(self, peak: int, counter: str) -> None:
        """Search on right behind a peak that is not followed."""
        self.counters[counter] += 1
        self._at = peak + RETRY_AFTER

    def _payload(self, burst: Payload, events: list[Event]) -> bool:
        """Process the symbols up to the end of a PDU, and report that PDU."""
        if self.next_index < burst.need:
            return False
        points = burst.take(self._samples, self._first, self.cuts)
        if self._on_points is not None:
            self._on_points(points.astype(np.complex64), burst.plan.mcs.modulation)
        lacks_power = False
        while burst.is_next_in() and not lacks_power:
            begin = burst.judged
            data, lacks_power, plain_until = burst.count()
            is_last = burst.n_done == burst.plan.n_pdus
            if data is not None:
                self.counters["pdus_good"] += 1
                quality = burst.acquired.quality
                at, doppler = burst.judged + BACKOFF, burst.doppler if is_last else None
                events.append(PduHeard(data, burst.n_done - 1, at, quality, burst.snr_db, doppler))
                lacks_power = False
                # It may have outlived the begin of another burst; if so, the next one will not.
                until = burst.judged if is_last else max(begin, burst.judged - BACK)
                if min(until, plain_until) >= begin:
                    self._explained.append((begin, min(until, plain_until)))
            else:
                self.counters["pdus_bad"] += 1
        if burst.n_done == burst.plan.n_pdus:
            self._end(burst, events, "whole")
        elif lacks_power:
            self._end(burst, events, "faded")
        else:
            burst.slip()
        return True

    def _end(self, burst: Payload, events: list[Event], ending: str) -> None:
        """End a burst; the search goes on behind what its good PDUs explain."""
        self._bursts.remove(burst)
        if ending != "whole":
            self.counters[f"bursts_{ending}"] += 1
        if ending == "faded" and not self._bursts:
            self.claim = self._screening.claim(burst.acquired.quality, burst.judged + BACKOFF)
        if not burst.n_good:
            self._screening.missed()
        events.append(BurstOver(burst.acquired.quality, burst.n_good, ending))
