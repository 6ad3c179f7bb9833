"""How long a burst may be for its samples to be made in time."""

OVERHEAD_S = 3.5e-4
"""Seconds from the decision to the radio, besides modulating."""
PER_SAMPLE_S = 2e-8
SLOWER, FASTER = 1.02, 0.94
"""Factors of the time that a sample is believed to take, after a burst that took more, or less.

So one of four bursts takes less. Who is held up now and then gains nothing by shorter bursts.
"""


class Tempo:
    """The time that modulating takes, learned from each burst."""

    def __init__(self) -> None:
        self._per_sample_s = PER_SAMPLE_S

    def note(self, n_samples: int, seconds: float) -> None:
        """Learn that modulating a burst of `n_samples` took so many seconds."""
        is_slower = seconds > self._per_sample_s * n_samples
        self._per_sample_s *= SLOWER if is_slower else FASTER

    def samples_in(self, seconds: float) -> int:
        """How many samples can be modulated and reach the radio within that time."""
        return max(0, int((seconds - OVERHEAD_S) / self._per_sample_s))
