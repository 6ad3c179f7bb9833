"""Measures whether the receiver keeps up."""


class LoadMeter:
    """Processor time that a second of samples takes, a running mean over about a second."""

    SPAN_S = 1.0

    def __init__(self) -> None:
        self._share = 0.0

    def add(self, cpu_s: float, stream_s: float) -> None:
        """Take into account that a block of `stream_s` took `cpu_s` of processor time."""
        weight = min(1.0, stream_s / self.SPAN_S)
        self._share += weight * (cpu_s / stream_s - self._share)

    @property
    def realtime_ratio(self) -> float:
        """How many times faster than real time samples are processed; 0 before the first block."""
        return 1 / self._share if self._share else 0.0
