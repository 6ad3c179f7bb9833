"""Takes tones, narrow signals, sweeps and short pulses out of a stream before the search."""

import math
from collections import Counter
from operator import attrgetter
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from phy import compute
from phy.blanker import Blanker
from phy.cuts import Cuts
from phy.sizes import N_LANES
from phy.stream import SampleStream
from phy.tables.notch import SIZE, STRIDE, new_notch_memory
from phy.tables.sensing import LEAST_FLOOR

APART = 4 * SIZE
"""While there are no lines, one window in so many samples is looked at."""
GROUP = N_LANES * APART
"""They are looked at in groups: a line is found after about so many samples."""
LOOK_EVERY = 16
"""What is told of lines is of one window in so many."""
RELEASE = 64
"""Number of windows without a line, one after another, after which all is left as it is."""


class Line(NamedTuple):
    """A tone or narrow signal that was cut: its middle in cycles per sample, and its power."""

    frequency: float
    power_dbfs: float
    width: float
    """Share of the band that is cut for it."""
    moves: bool
    """Whether its frequency has changed since an earlier look, as that of a sweep does."""


class Excisor:
    """Hands on a stream of samples, without pulses, and without lines in its spectrum.

    It acts only while there are any. Beside lines, what it hands on is up to SIZE samples behind,
    and has no DC. Windows lie at absolute indices, so any chunking gives the same samples.

    What misleads it: a burst with the spectrum of lines. The way back: RELEASE windows without one.
    """

    def __init__(self, start: int = 0) -> None:
        self.cuts = Cuts()
        self.counters: Counter[str] = Counter()
        self._memory = new_notch_memory()
        self._cut = np.zeros((N_LANES, SIZE), np.uint8)
        self._found = np.zeros(N_LANES, np.int64)
        self._room = np.empty(N_LANES * STRIDE, np.complex64)
        self._raw = SampleStream(start, 1 << 16)
        self._blanker = Blanker(self.counters, self.cuts)
        self._is_active = False
        self._seen: tuple[NDArray[np.complex64], NDArray[np.uint8], NDArray[np.uint8]] | None = None
        """While it acts: a window with lines, its mask, and an earlier one's."""
        self._look_again = 0
        self._restart(start)

    @property
    def next_index(self) -> int:
        """Absolute index of the next sample to push."""
        return self._raw.end

    @property
    def lines(self) -> list[Line]:
        """What is cut now, the strongest first; may be read from any thread."""
        seen = self._seen
        if seen is None:
            return []
        x, mask, earlier = seen
        powers = np.abs(np.fft.fft((x - x.mean()) * self._memory.content.window)) ** 2
        bins = np.flatnonzero(np.roll(mask, SIZE // 2))
        found = []
        for group in np.split(bins, np.flatnonzero(np.diff(bins) > 1) + 1):
            each = group - SIZE // 2
            of_each = powers[each]
            # By Parseval's theorem; the mean of the window's square is 1/2.
            power_dbfs = 10 * math.log10(max(float(of_each.sum()) / (SIZE * SIZE / 2), LEAST_FLOOR))
            middle = float(np.average(each, weights=of_each)) / SIZE
            found.append(Line(middle, power_dbfs, len(group) / SIZE, not earlier[each].any()))
        return sorted(found, key=attrgetter("power_dbfs"), reverse=True)

    def push(self, samples: NDArray[np.complex64]) -> NDArray[np.complex64]:
        """Take the next samples `[n]`; returns those that are ready, valid until the next call."""
        if bad := self._raw.append(samples):
            self.counters["samples_bad"] += bad
        self._ready = self._blanker.run(self._raw)
        parts: list[NDArray[np.complex64]] = []
        while self._cut_lines(parts) if self._is_active else self._look(parts):
            pass
        self._raw.forget_before(min(self._at, self._next, self._blanker.next_index))
        return parts[0] if len(parts) == 1 else np.concatenate((*parts, np.empty(0, np.complex64)))

    def flush(self) -> NDArray[np.complex64]:
        """Return the samples that are not handed on yet, as if silence followed."""
        return self.gap(0)

    def gap(self, n: int) -> NDArray[np.complex64]:
        """Note that `n` samples are missing; returns those before that were not handed on yet."""
        if n < 0:
            raise ValueError(f"gap: got {n} samples; allowed: 0 or more")
        end, at = self._raw.end, self._at
        rest = np.empty(0, np.complex64)
        if at < end:
            rest = self.push(np.zeros(SIZE + STRIDE, np.complex64))[: end - at].copy()
        self._blanker.end(self._raw)
        n_windows = (end - self._next - SIZE) // APART + 1
        if not self._is_active and n_windows > 0 and self._has_lines(n_windows):
            self._is_active, self._n_clean = True, 0
        self._restart(end + n)
        return rest

    def _restart(self, index: int) -> None:
        """Go on at `index`, with silence before it."""
        first = (index // STRIDE - 1) * STRIDE
        self._raw.restart(first)
        self._raw.append(np.zeros(index - first, np.complex64))
        self._memory.content.tail[:] = 0
        self._memory.content.held[:] = 0
        self._blanker.restart(first)
        self._at = self._ready = index
        self._next = first if self._is_active else first + 2 * STRIDE

    def _look(self, parts: list[NDArray[np.complex64]]) -> bool:
        """Hand on samples as they are, and look for lines; False: more samples are needed."""
        end, last = self._ready, self._next + GROUP - APART + SIZE
        if end < last:
            if end > self._at:
                parts.append(self._raw.view(self._at, end))
                self._at = end
            return False
        if not self._has_lines(N_LANES):
            self._next += GROUP
            return True
        # Lines go from the next stride on; all up to there may have been handed on already.
        begin = -(-last // STRIDE) * STRIDE
        self._is_active, self._n_clean, self._next = True, 0, begin - STRIDE
        if self._at < begin:
            ready = min(begin, end)
            parts.append(self._raw.view(self._at, ready))
            self._at = ready
        return True

    def _has_lines(self, n: int) -> bool:
        """Whether one of the next `n` windows that are looked at has lines."""
        x = self._raw.view(self._next, self._next + (n - 1) * APART + SIZE)
        return bool(compute.find_lines(x, n, APART, self._memory, self._cut) >= 0)

    def _cut_lines(self, parts: list[NDArray[np.complex64]]) -> bool:
        """Take lines out of up to eight windows; False: more samples are needed."""
        n = min((self._ready - self._next) // STRIDE - 1, N_LANES)
        if n < 1:
            return False
        x = self._raw.view(self._next, self._next + (n + 1) * STRIDE)
        compute.cut_lines(x, n, self._memory, self._room, self._cut, self._found)
        for i in range(n):
            self._note(self._next // STRIDE + i, i, x)
            if self._n_clean == RELEASE:
                self._is_active, self._seen, n = False, None, i + 1
                break
        ready = self._next + n * STRIDE
        if ready > self._at:
            # What lies before was handed on as it was.
            parts.append(self._room[self._at - self._next : n * STRIDE].copy())
            self._at = ready
        self._next = ready
        return True

    def _note(self, window: int, lane: int, x: NDArray[np.complex64]) -> None:
        n = int(self._found[lane])
        self._n_clean = self._n_clean + 1 if n <= 0 else 0
        self.counters["windows_notched"] += n > 0
        self.counters["windows_not_notched"] += n < 0
        if n > 0:
            mask = self._cut[lane].copy()
            self.cuts.add(window, mask)
            if window >= self._look_again:
                earlier = mask if self._seen is None else self._seen[1]
                self._seen = x[lane * STRIDE : lane * STRIDE + SIZE].copy(), mask, earlier
                self._look_again = window + LOOK_EVERY
