"""Measures whether the receiver keeps up with the samples."""

import time


class LoadMeter:
    """CPU time per second of samples, as a running mean over about a second."""

    SPAN_S = 1.0
    EVERY = 8
    """One block in this many is measured, because reading a thread's CPU time is slow."""

    def __init__(self) -> None:
        self._share = 0.0
        self._blocks = 0

    def begin(self) -> float | None:
        """Note that the calling thread begins with a block; the result is for `end`."""
        self._blocks += 1
        return time.thread_time() if self._blocks % self.EVERY == 1 else None

    def end(self, began: float | None, stream_s: float) -> None:
        """Note that the thread is done with a block of `stream_s` seconds."""
        if began is not None:
            self.add(time.thread_time() - began, stream_s)

    def add(self, cpu_s: float, stream_s: float) -> None:
        """Note that a measured block of `stream_s` seconds took `cpu_s` seconds of CPU time."""
        weight = min(1.0, self.EVERY * stream_s / self.SPAN_S)
        self._share += weight * (cpu_s / stream_s - self._share)

    @property
    def realtime_ratio(self) -> float:
        """Processing speed as a multiple of real time; 0 before the first block."""
        return 1 / self._share if self._share else 0.0
