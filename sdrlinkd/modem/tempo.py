"""How long a burst may be to be modulated in time."""

OVERHEAD_S = 3.5e-4
"""From the decision to the radio, besides modulating."""
PER_SAMPLE_S = 2e-8
SLOWER, FASTER = 1.02, 0.94
"""By so much the time a sample takes is believed to be another when it was more, or less: what one
of four bursts gets by with. Who is held up by others now and then gains nothing by shorter bursts.
"""


class Tempo:
    """What modulating takes, learned from each burst."""

    def __init__(self) -> None:
        self._per_sample_s = PER_SAMPLE_S

    def note(self, n_samples: int, seconds: float) -> None:
        """A burst took so long."""
        is_slower = seconds > self._per_sample_s * n_samples
        self._per_sample_s *= SLOWER if is_slower else FASTER

    def samples_in(self, seconds: float) -> int:
        """So many reach the radio within that time."""
        return max(0, int((seconds - OVERHEAD_S) / self._per_sample_s))
