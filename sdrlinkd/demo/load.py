"""Measures how much of the time a daemon and its modem run, and wait for a CPU."""

import contextlib
import time
from typing import NamedTuple

from sdrlinkd.family import family_threads


class Load(NamedTuple):
    """Load of the busiest thread of a daemon and its modem, as shares of the time.

    `busy` is the share in which it ran or waited for a CPU, `waited` the part in which it waited.
    """

    busy: float
    waited: float


class LoadOf:
    """Measures the load of a process and all below it, from the creation of this object on."""

    def __init__(self, pid: int) -> None:
        self._pid = pid
        self._began = time.monotonic()
        self._before = self._times()

    def read(self) -> Load:
        """The load of the busiest thread since the creation of this object."""
        span_s = time.monotonic() - self._began
        loads = []
        for task, (ran_s, waited_s) in self._times().items():
            ran_before_s, waited_before_s = self._before.get(task, (0.0, 0.0))
            # A wait counts when it ends, even that before the span.
            waited = min(1.0, (waited_s - waited_before_s) / span_s)
            busy = min(1.0, (ran_s - ran_before_s) / span_s + waited)
            loads.append(Load(busy, waited))
        return max(loads, default=Load(0.0, 0.0))

    def _times(self) -> dict[str, tuple[float, float]]:
        """(time running, time waiting for a CPU) in s, by thread."""
        found = {}
        for task in family_threads(self._pid):
            # Threads may end at any time.
            with contextlib.suppress(OSError):
                ran, waited, _ = (task / "schedstat").read_text().split()
                found[task.name] = (int(ran) * 1e-9, int(waited) * 1e-9)
        return found
