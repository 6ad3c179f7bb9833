"""Estimates how long a burst may be so that its samples are modulated in time."""

OVERHEAD_S = 1e-4
"""Time in s from the decision to the modem, without modulation."""
PER_SAMPLE_S = 2e-8
SLOWER, FASTER = 1.02, 0.94
"""Factors on the estimated time per sample, after a burst that took longer, or less long.

The estimate settles where one of four bursts takes less time. So occasional delays, for which
shorter bursts would not help, have little effect.
"""


class Tempo:
    """The time that modulation takes, learned from each burst."""

    def __init__(self) -> None:
        self._per_sample_s = PER_SAMPLE_S

    def note(self, n_samples: int, seconds: float) -> None:
        """Learn that the modulation of `n_samples` samples took `seconds`."""
        is_slower = seconds > self._per_sample_s * n_samples
        self._per_sample_s *= SLOWER if is_slower else FASTER

    def seconds(self, n_samples: int) -> float:
        """How long the modulation of `n_samples` samples takes, in s."""
        return self._per_sample_s * n_samples

    def samples_in(self, seconds: float) -> int:
        """How many samples can be modulated and reach the radio within `seconds`."""
        return max(0, int((seconds - OVERHEAD_S) / self._per_sample_s))
