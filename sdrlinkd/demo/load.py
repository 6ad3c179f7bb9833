"""How much of the time a process works, and how much it waits for a processor."""

import contextlib
import time
from pathlib import Path
from typing import NamedTuple


class Load(NamedTuple):
    """Shares of the time, of the busiest thread: it ran or wanted to, and it only wanted to."""

    busy: float
    waited: float


class LoadOf:
    """The load of a process since this was made."""

    def __init__(self, pid: int) -> None:
        self._tasks = Path(f"/proc/{pid}/task")
        self._began = time.monotonic()
        self._before = self._times()

    def read(self) -> Load:
        """The load since this was made up to now, by thread."""
        span_s = time.monotonic() - self._began
        loads = []
        for task, (ran_s, waited_s) in self._times().items():
            ran_before_s, waited_before_s = self._before.get(task, (0.0, 0.0))
            waited = (waited_s - waited_before_s) / span_s
            loads.append(Load((ran_s - ran_before_s) / span_s + waited, waited))
        return max(loads, default=Load(0.0, 0.0))

    def _times(self) -> dict[str, tuple[float, float]]:
        """By thread, in s: it ran, and it waited."""
        found = {}
        for task in self._tasks.iterdir():
            # Threads end at any time.
            with contextlib.suppress(OSError):
                ran, waited, _ = (task / "schedstat").read_text().split()
                found[task.name] = (int(ran) * 1e-9, int(waited) * 1e-9)
        return found
