"""When the next block is due."""

import asyncio
import time


class Pace:
    """The monotonic clock in samples: blocks come when their last sample would have."""

    def __init__(self, rate_hz: float, paced: bool, max_behind_s: float) -> None:
        self._rate_hz = rate_hz
        self._paced = paced
        self._max_behind = round(max_behind_s * rate_hz)
        self._origin_ns = time.monotonic_ns()

    def restart(self) -> None:
        """Index 0 is now."""
        self._origin_ns = time.monotonic_ns()

    def host_ns(self, index: int) -> int:
        """Monotonic time at which the sample before `index` was there."""
        if not self._paced:
            return time.monotonic_ns()
        return self._origin_ns + round(index / self._rate_hz * 1e9)

    async def wait_for(self, index: int) -> int:
        """Until all samples before `index` are there; how many further ones are already."""
        if not self._paced:
            await asyncio.sleep(0)
            return 0
        ahead_s = (self.host_ns(index) - time.monotonic_ns()) * 1e-9
        await asyncio.sleep(max(0.0, ahead_s))
        return max(0, round((time.monotonic_ns() - self.host_ns(index)) * 1e-9 * self._rate_hz))

    def overdue(self, behind: int) -> int:
        """How many samples must be given up when `behind` are waiting."""
        return behind if behind > self._max_behind else 0
