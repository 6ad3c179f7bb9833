"""When the next block is due."""

import threading
import time


class Pace:
    """The monotonic clock in samples: blocks come when their last sample would have."""

    def __init__(self, rate_hz: float, paced: bool) -> None:
        self._rate_hz = rate_hz
        self._paced = paced
        self._origin_ns = time.monotonic_ns()
        self._ended = threading.Event()

    def restart(self) -> None:
        """Set index 0 to now."""
        self._origin_ns = time.monotonic_ns()

    def host_ns(self, index: int) -> int:
        """Monotonic time at which the sample before `index` was there."""
        if not self._paced:
            return time.monotonic_ns()
        return self._origin_ns + round(index / self._rate_hz * 1e9)

    def wait_for(self, index: int) -> int:
        """Block until all samples before `index` are there; how many further ones are already."""
        if not self._paced:
            return 0
        ahead_s = (self.host_ns(index) - time.monotonic_ns()) * 1e-9
        if ahead_s > 0:
            self._ended.wait(ahead_s)
            return 0
        return round(-ahead_s * self._rate_hz)

    def end(self) -> None:
        """Wake up whoever waits; nobody waits any more."""
        self._ended.set()
