"""Signs of life of a process, and whether they are missing."""

import time

BEAT_S = 0.1
"""Time between two signs of life, in s."""
WATCH_S = 0.5
"""Time between two looks for them, in s."""
HUNG_S = 5.0
"""Time in s without a sign of life, while this process was awake, after which the other hangs."""


class SignsOfLife:
    """Notices that the process gives no signs of life while this one does."""

    def __init__(self) -> None:
        self._beat_s = 0.0
        self._looked_s = time.monotonic()
        self._missed_s = 0.0

    def are_missing(self, beat_s: float) -> bool:
        """Whether the last sign, at `beat_s`, has been the same for HUNG_S."""
        now_s = time.monotonic()
        # Only time in which this process could run counts: a busy machine delays both.
        self._missed_s += min(now_s - self._looked_s, 2 * WATCH_S)
        self._looked_s = now_s
        if beat_s != self._beat_s:
            self._beat_s, self._missed_s = beat_s, 0.0
        return self._missed_s > HUNG_S
