"""One timer for whatever is due next."""

import asyncio
import time
from collections.abc import Callable
from math import inf


class Alarm:
    """Calls `ring` when something is due; times in s of the monotonic clock."""

    def __init__(self, ring: Callable[[], None]) -> None:
        self._ring = ring
        self._timer: asyncio.TimerHandle | None = None
        self._at = inf

    def ring_by(self, at: float) -> None:
        """Ring at `at` or before; `ring` has to look what is due then, and what is due next."""
        if at >= self._at:
            return
        if self._timer is not None:
            self._timer.cancel()
        delay_s = max(0.0, at - time.monotonic())
        self._timer = asyncio.get_running_loop().call_later(delay_s, self._now)
        self._at = at

    def _now(self) -> None:
        self._timer, self._at = None, inf
        self._ring()
