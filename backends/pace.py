"""When the next block is due."""

import threading
import time


class Pace:
    """The monotonic clock in samples: a block is due at the time of its last sample."""

    def __init__(self, rate_hz: float, paced: bool) -> None:
        self._rate_hz = rate_hz
        self._paced = paced
        self._origin_ns = time.monotonic_ns()
        self._woken, self._is_over = threading.Event(), False

    def restart(self) -> None:
        """Set the time of index 0 to now."""
        self._origin_ns = time.monotonic_ns()

    def host_ns(self, index: int) -> int:
        """Monotonic time of the sample before `index`."""
        if not self._paced:
            return time.monotonic_ns()
        return self._origin_ns + round(index / self._rate_hz * 1e9)

    def wait_for(self, index: int) -> int:
        """Wait until all samples before `index` are due; returns how many more are due already.

        The result is negative if `wake` was called: so many samples are not due yet.
        """
        if not self._paced:
            return 0
        ahead_s = (self.host_ns(index) - time.monotonic_ns()) * 1e-9
        if ahead_s > 0:
            if not self._woken.wait(ahead_s) or self._is_over:
                return 0
            self._woken.clear()
            ahead_s = (self.host_ns(index) - time.monotonic_ns()) * 1e-9
            return min(0, -round(ahead_s * self._rate_hz))
        return round(-ahead_s * self._rate_hz)

    def wake(self) -> None:
        """End the present wait, or the next one."""
        self._woken.set()

    def end(self) -> None:
        """Wake up any thread that waits; from now on none waits."""
        self._is_over = True
        self._woken.set()
