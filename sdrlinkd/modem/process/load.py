"""Measures whether the receiver keeps up with the samples."""


class LoadMeter:
    """CPU time per second of samples, as a running mean over about a second."""

    SPAN_S = 1.0

    def __init__(self) -> None:
        self._share = 0.0

    def add(self, cpu_s: float, stream_s: float) -> None:
        """Note that a block of `stream_s` seconds took `cpu_s` seconds of CPU time."""
        weight = min(1.0, stream_s / self.SPAN_S)
        self._share += weight * (cpu_s / stream_s - self._share)

    @property
    def realtime_ratio(self) -> float:
        """Processing speed as a multiple of real time; 0 before the first block."""
        return 1 / self._share if self._share else 0.0
