"""Energy detection: whether the channel is busy, even with bursts that cannot be read."""

import math

import numpy as np
from numpy.typing import NDArray

from phy import compute
from phy.sizes import SENSE_WINDOW
from phy.stream import LARGEST_SAMPLE
from phy.tables.sensing import (
    BUSY_UNTIL,
    CARRIER_UNTIL,
    EXPLAINED_UNTIL,
    FILLED,
    FLOOR,
    LEAST_FLOOR,
    LEAST_PULSE,
    MOST_PULSE,
    MOST_SHORT,
    N_SHORT,
    N_STATE,
    NEXT,
    RUN_FROM,
    SHORT,
)

PATIENCE = 40_000
"""Samples of energy without a burst that become noise: 40 ms at 1 Msps."""


class EnergyDetector:
    """Detects energy above the noise floor, in windows of WINDOW samples.

    The floor starts as the first window's power and follows quiet windows (at once to a power below
    half, otherwise by 1/64 of the difference). Windows are contiguous from `start` on.

    Busy windows with at most three quiet ones in between are a run. A run as short as a pulse of
    energy may be one; a longer one is a carrier.

    What misleads the floor: samples without noise (a muted or starting radio), a gain that rises, a
    foreign signal that stays. The way back: a run of `patience` samples that no burst explains
    becomes the floor; and a window with less than half of the floor is the new floor.
    """

    def __init__(self, threshold_db: float = 6.0, start: int = 0, patience: int = PATIENCE) -> None:
        if not 0 < threshold_db < math.inf:
            raise ValueError(f"threshold in dB: got {threshold_db}; allowed: more than 0")
        self.threshold_db = threshold_db
        self._threshold = 10 ** (threshold_db / 10)
        self._patience = patience
        self._state = np.zeros(N_STATE)
        self._state[[BUSY_UNTIL, NEXT, RUN_FROM, CARRIER_UNTIL, EXPLAINED_UNTIL]] = start

    @property
    def next_index(self) -> int:
        """Absolute index of the next sample to push."""
        return int(self._state[NEXT])

    @property
    def busy_until(self) -> int:
        """Absolute index after the last busy window; `start` if there has been none."""
        return int(self._state[BUSY_UNTIL])

    @property
    def carrier_until(self) -> int:
        """Absolute index after the last busy window of a carrier; `start` if there was none."""
        return int(self._state[CARRIER_UNTIL])

    def pulses(self, since: float = -math.inf) -> list[int]:
        """Absolute indices after `since` at which runs began that may be pulses, ascending.

        They are exact to a window. The last 16 are known, and the present one, which may still turn
        out to be the begin of a carrier.
        """
        state, n = self._state, int(self._state[N_SHORT])
        found: list[int] = []
        # Most blocks have none, so the newest come first.
        for i in range(n - 1, max(0, n - MOST_SHORT) - 1, -1):
            begin = int(state[SHORT + i % MOST_SHORT])
            if begin <= since:
                break
            found.insert(0, begin)
        length = state[BUSY_UNTIL] - state[RUN_FROM]
        is_over = state[NEXT] >= state[BUSY_UNTIL] + SENSE_WINDOW
        if LEAST_PULSE <= length <= MOST_PULSE and is_over and state[RUN_FROM] > since:
            found.append(int(state[RUN_FROM]))
        return found

    @property
    def noise_dbfs(self) -> float:
        """The noise floor in dBFS; LEAST_FLOOR before the first window."""
        return 10 * math.log10(max(float(self._state[FLOOR]), LEAST_FLOOR))

    def push(self, samples: NDArray[np.complex64]) -> None:
        """Take the next samples `[n]`, complex64, and judge the windows that they complete."""
        x = np.ascontiguousarray(samples, np.complex64)
        compute.sense(x, self._threshold, LARGEST_SAMPLE, self._patience, self._state)

    def explain(self, until: int) -> None:
        """Note that a burst explains the energy before the absolute index `until`."""
        self._state[EXPLAINED_UNTIL] = max(self._state[EXPLAINED_UNTIL], until)

    def gap(self, n: int) -> None:
        """Note that `n` samples are missing: the floor is kept, an incomplete window dropped.

        The next window begins right after the gap, not at a multiple of WINDOW. So a window always
        has WINDOW received samples, and the samples after a gap count at once.
        """
        if n < 0:
            raise ValueError(f"gap: got {n} samples; allowed: 0 or more")
        self._state[NEXT] += n
        self._state[FILLED] = 0
