"""Sets short pulses of interference to zero: of ignition, of radars, of radios that hop."""

from collections import Counter

import numpy as np

from phy import compute
from phy.cuts import Cuts
from phy.stream import SampleStream
from phy.tables.blanking import BLOCK, WINDOW

STEP = WINDOW - 2 * BLOCK
GROUP = 20 * STEP
"""While there are no pulses, so many samples are looked at, at once."""
RELEASE = 256
"""Number of blocks without a pulse, one after another, after which all is left as it is."""
_AT_ONCE = 256


class Blanker:
    """Sets pulses in a stream of samples to 0, where they are stored.

    It acts only while there are pulses. Blocks lie at absolute indices, so any chunking gives the
    same samples.

    What misleads it: a signal that is made of pulses shorter than half of a block. The way back:
    RELEASE blocks without one.
    """

    def __init__(self, counters: Counter[str], cuts: Cuts) -> None:
        self.is_active = False
        """Whether samples have to wait for those behind them."""
        self._counters, self._cuts = counters, cuts
        self._power = np.empty(BLOCK, np.float32)
        self._found = np.zeros(_AT_ONCE, np.uint8)
        self._before = 0.0
        self._next = self._n_clean = 0

    @property
    def next_index(self) -> int:
        """Absolute index of the first sample that it still needs."""
        return self._next

    def restart(self, index: int) -> None:
        """Go on at `index`, a multiple of BLOCK, with silence before it."""
        self._next, self._before = index, 0.0

    def run(self, stream: SampleStream) -> int:
        """Blank what can be judged; returns the index before which all samples are ready."""
        while True:
            if self.is_active:
                n = min((stream.end - self._next) // BLOCK - 1, RELEASE - self._n_clean, _AT_ONCE)
                if n < 1:
                    return min(self._next, stream.end)
                self._blank(stream, n)
            else:
                if stream.end < self._next + GROUP + 2 * BLOCK:
                    return stream.end
                self._look(stream, GROUP)
                self._next += GROUP

    def end(self, stream: SampleStream) -> None:
        """Look at what is there of a group, after which samples are missing."""
        n = (stream.end - self._next - WINDOW) // STEP + 1
        if not self.is_active and n > 0:
            self._look(stream, n * STEP)

    def _look(self, stream: SampleStream, n: int) -> None:
        x = stream.view(self._next, self._next + n + 2 * BLOCK)
        if compute.find_pulses(x, self._power):
            self.is_active, self._n_clean, self._before = True, 0, 0.0

    def _blank(self, stream: SampleStream, n: int) -> None:
        x = stream.view(self._next, self._next + (n + 1) * BLOCK)
        self._before = compute.blank(x, n, self._before, self._power, self._found)
        pulses = np.flatnonzero(self._found[:n])
        self._counters["pulses_blanked"] += len(pulses)
        for i in pulses.tolist():
            self._cuts.blank(self._next // BLOCK + i, x[i * BLOCK : (i + 1) * BLOCK] == 0)
        self._n_clean = n - 1 - int(pulses[-1]) if len(pulses) else self._n_clean + n
        self.is_active = self._n_clean < RELEASE
        self._next += n * BLOCK
