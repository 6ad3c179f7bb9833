"""The streaming receiver: samples in, PDUs out.

A burst begins with a preamble that repeats a segment under a code of signs. SEARCH slides the
normalised autocorrelation of segments over the stream. It costs a few operations per sample, does
not depend on the frequency offset, and crosses its threshold somewhere within the preamble. ALIGN
finds the maximum within a preamble's length of that crossing, because only there all segments
contribute. It rejects a tone or another network's signal, whose peak does not need the code.
ACQUIRE correlates with the long training at all possible offsets, which yields start and frequency.
It estimates the channel and reads the header: only a header with a valid check makes a peak a
burst. Then, as after any failure, the search continues.

::

              crossing          peak
    SEARCH ────────────▶ ALIGN ───────▶ ACQUIRE
       ▲                   │ nothing       │ a burst, or none
       └───────────────────┴───────────────┘

The payload is received beside the search, PDU by PDU. The search waits for each PDU: it passes over
a good one, and looks into a bad one, in which another burst may have begun. So it does into what is
louder than the burst. No header makes the receiver deaf, whatever it announces.

Each step waits for the samples it needs. The result for a sample does not depend on how many came
with it: any chunking yields the same events.
"""

import cmath
import math
from collections import Counter, deque
from collections.abc import Callable, Mapping
from enum import Enum, auto
from functools import partial
from operator import attrgetter

import numpy as np
from numpy.typing import NDArray

from phy import compute, preamble
from phy.acquisition import Missed, before, needed_after
from phy.cuts import Cuts
from phy.demodulation import Demodulator
from phy.expected import Expected, OtherLink
from phy.incoming import BACK, IncomingBurst, OnPoints, Place
from phy.layout import layout
from phy.numerology import OFDM_64_16, Numerology
from phy.quality import BurstOver, Claim, Event, PduHeard
from phy.screening import Screening
from phy.sizes import SLIP_EVERY
from phy.stream import SampleStream
from phy.tables.acquisition import BACKOFF
from phy.tables.detector import HISTORY, new_search_memory
from phy.wariness import THRESHOLD, Wariness

HOP = 512
ALIGN_SPAN = preamble.SHORT
PLAINEST = 0.7
"""A peak at least this strong without the preamble's code is not a preamble."""
MOST_BURSTS = 2
"""A burst that begins in another one is received beside it; a third takes the worse one's place."""
# Number of samples after a false alarm at which the search continues.
RETRY_AFTER = 16
# Maximum number of samples processed at once, to limit memory on large calls.
PIECE = 1 << 16


class State(Enum):
    """What the search for the next burst waits for."""

    SEARCH = auto()
    """The metric crosses its threshold."""
    ALIGN = auto()
    """The preamble's length after the crossing has arrived."""
    ACQUIRE = auto()
    """Training and header after the peak have arrived."""

    # That of Enum runs in the interpreter, and every burst takes a dozen.
    __hash__ = object.__hash__


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
        on_points: OnPoints | None = None,
        expected: Expected | None = None,
    ) -> None:
        self._screening = Screening(network, expected, start)
        self._grid = grid
        self.on_points = on_points
        self._new_place = partial(Place, grid, max_frequency, centre_cycles)
        self._places: list[Place] = []
        """Those that no burst has; the last one is for the next burst."""
        self._demodulator = Demodulator(grid)
        self.cuts: Cuts | None = None
        self._powers, self._hidden = np.empty(SLIP_EVERY, np.float32), np.empty(SLIP_EVERY)
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
        }
        self._bursts: list[IncomingBurst] = []
        """Bursts in progress, by the order of their headers."""
        self._explained: deque[tuple[int, int]] = deque()
        """Begin and end of good PDUs that the search has not come to yet, and will leave out."""
        # What is known in the present state of the search.
        self._crossing, self._peak, self._coarse = start, start, 0.0
        self._wariness = Wariness(start)
        self._at = self._began = start
        self.claim = Claim(start, start)
        """The air that the last header claims."""
        self.counters: Counter[str] = Counter()
        self._begin(start)

    def others(self, n_samples: int) -> list[OtherLink]:
        """Other links that were heard often in the last `n_samples`; safe on any thread."""
        return self._screening.others(self._stream.end - n_samples)

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
            while self._step(events) if self._bursts else self._steps[self._state](events):
                pass
            needed = self._at - self._kept
            for burst in self._bursts:
                needed = min(needed, burst.at)
            self._stream.forget_before(needed)
        return events

    def gap(self, n: int) -> list[Event]:
        """Note that `n` samples are missing: all bursts end, the search restarts."""
        if n < 0:
            raise ValueError(f"gap: got {n} samples; allowed: 0 or more")
        self.counters["gaps"] += 1
        end = self._stream.end
        events: list[Event] = []
        if self._bursts:
            self._cut(events)
        elif end > self._at:
            events = self.flush()
        self._state = State.SEARCH
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
        if self._bursts:
            self._cut(events)
            self._state = State.SEARCH
        return events

    def _cut(self, events: list[Event]) -> None:
        while self._bursts:
            self._end(self._bursts[0], events, "cut")
        self._at = max(self._at, self._stream.end)

    def _begin(self, index: int) -> None:
        """Start the search at `index`, with silence before it."""
        self._stream.restart(index - self._kept)
        self._stream.append(np.zeros(self._kept, np.complex64))
        self._at = self._began = index
        self._explained.clear()

    def _pass_by(self, peak: int, counter: str) -> None:
        """Search on right behind a peak that is not followed."""
        self.counters[counter] += 1
        self._state = State.SEARCH
        self._at = peak + RETRY_AFTER

    # Steps return False if they need more samples.

    def _step(self, events: list[Event]) -> bool:
        """Take the step that needs the fewest samples, so that any chunking gives one order."""
        burst = newest = self._bursts[-1]
        if len(self._bursts) > 1:
            burst = min(self._bursts, key=attrgetter("need"))
        if self._state is State.SEARCH:
            is_behind = self._at + HOP <= newest.judged
            return (is_behind and self._search(events)) or self._receive(burst, events)
        needed = self._peak - self._before + self._span
        if self._state is State.ALIGN:
            needed = self._crossing + ALIGN_SPAN
        step = self._steps[self._state]
        return step(events) if needed <= burst.need else self._receive(burst, events)

    def _search(self, _: list[Event]) -> bool:
        """Slide the metric over whole hops of samples, up to the first crossing."""
        # The bound moves the position, too.
        until = self._searchable()
        n_hops = (until - self._at) // HOP
        if n_hops < 1:
            return False
        first = self._at - HISTORY
        x = self._stream.view(first, self._at + n_hops * HOP)
        wary, age = self._wariness.excess, self._at - self._wariness.raised_at
        found = compute.search(x, n_hops, HOP, THRESHOLD, wary, age, self._memory)
        begin = self._at
        if found < 0:
            self._at += n_hops * HOP
        else:
            self.counters["triggers"] += 1
            self._at = self._crossing = first + found
            self._state = State.ALIGN
        if self._bursts:
            self.counters["samples_searched_again"] += self._at - begin
        return True

    def _searchable(self) -> int:
        """Absolute index before which all is there to search: what no good PDU explains."""
        while self._explained:
            begin, end = self._explained[0]
            if self._at + HOP <= begin:
                return begin
            self._at = max(self._at, end)
            self._explained.popleft()
        return self._bursts[-1].judged if self._bursts else self._stream.end

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
            self._pass_by(self._peak, "peaks_skipped")
        else:
            self._coarse = cmath.phase(p) / (2 * math.pi * preamble.SEGMENT)
            self._state = State.ACQUIRE
        return True

    def _was_nothing(self, peak: int) -> None:
        """Search on after a false alarm, with a raised threshold: its source may return."""
        self._state = State.SEARCH
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
        if not self._places:
            self._places.append(self._new_place())
        acquisition = self._places[-1].acquisition
        found = acquisition.acquire(x, base, self._coarse, self._dc_value, self.cuts)
        self.counters["preambles"] += not isinstance(found, Missed) or found.stage != "preamble"
        if isinstance(found, Missed):
            self._screening.missed()
            if found.stage == "preamble":
                self._was_nothing(peak)
            else:
                self._pass_by(peak, "headers_bad")
            return True
        self._memory.content.heard(found.quality.noise)
        told = found.header
        plan = layout(self._grid, told.mcs, told.n_pdus, told.pdu_bytes)
        self._screening.note_other(told, found.quality.start)
        if self._screening.refuses(told, plan):
            self._screening.missed()
            self._pass_by(peak, "headers_refused")
            return True
        self._follow(
            IncomingBurst(self._places[-1], found, plan, self._grid, self._dc_value), events
        )
        return True

    def _follow(self, burst: IncomingBurst, events: list[Event]) -> None:
        """Receive a burst whose header was read, if it is one of ours."""
        found, self._state = burst.acquired, State.SEARCH
        claim = self._screening.claim(found.quality, burst.end + BACKOFF)
        if not self._bursts or claim.end > self.claim.end:
            self.claim = claim
        self._at = burst.at
        if self._screening.is_foreign(found.header):
            # The search continues in the burst: a false header must not make the receiver deaf.
            self.counters["bursts_foreign"] += 1
            self._screening.missed()
            events.append(BurstOver(found.quality, 0, "foreign"))
            self._at -= self._grid.n_cp
            return
        self.counters["bursts"] += 1
        self.counters["captures"] += len(self._bursts) > 0
        self._places.pop()
        if len(self._bursts) == MOST_BURSTS:
            self._end(min(self._bursts, key=attrgetter("n_good")), events, "displaced")
        self._bursts.append(burst)

    def _receive(self, burst: IncomingBurst, events: list[Event]) -> bool:
        """Decode PDUs of a burst that are complete, and count them one after another."""
        if not burst.decoded:
            if self._stream.end < burst.need:
                return False
            burst.take(
                self._stream, self._demodulator, self._powers, self._hidden, self.cuts,
                self.on_points,
            )  # fmt: skip
        if not burst.decoded:
            return True
        is_alone = len(self._bursts) == 1 and self._state is State.SEARCH
        quality, n_pdus, begin = burst.acquired.quality, burst.plan.n_pdus, burst.judged
        # What the good ones explain; so far, nothing.
        n_good, until = burst.n_good, begin - 1
        number = n_good + burst.n_bad
        while burst.decoded:
            data, end, plain_until, is_gone, snr_db = burst.decoded.popleft()
            number += 1
            is_last = number == n_pdus
            if data is not None:
                n_good += 1
                doppler = burst.doppler if is_last else None
                at = end + BACKOFF
                events.append(PduHeard(data, number - 1, at, quality, snr_db, doppler))
                # It may have outlived the begin of another burst; if so, the next one will not.
                known = plain_until if is_last else min(plain_until, max(burst.judged, end - BACK))
                until = known if known >= burst.judged else until
            burst.judged = end
            if data is None or plain_until < end or not is_alone:
                # The search may have to look into this one before the next one counts.
                break
        self.counters["pdus_good"] += n_good - burst.n_good
        self.counters["pdus_bad"] += data is None
        burst.n_good, burst.n_bad = n_good, number - n_good
        if until >= begin:
            self._explained.append((begin, until))
        if is_last:
            self._end(burst, events, "whole")
        elif is_gone:
            self._end(burst, events, "faded")
        return True

    def _end(self, burst: IncomingBurst, events: list[Event], ending: str) -> None:
        self._bursts.remove(burst)
        self._places.append(burst.place)
        if ending != "whole":
            self.counters[f"bursts_{ending}"] += 1
        if ending == "faded" and not self._bursts:
            self.claim = self._screening.claim(burst.acquired.quality, burst.judged + BACKOFF)
        if not burst.n_good:
            self._screening.missed()
        events.append(BurstOver(burst.acquired.quality, burst.n_good, ending))

    @property
    def _dc_value(self) -> complex:
        return self._memory.content.dc
