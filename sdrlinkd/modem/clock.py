"""The received stream as the clock: `now` is an index over the rate."""


class StreamClock:
    """Seconds since index 0; 0 until the first block. `host_s` is the monotonic clock at each call.

    In a paced stream, time goes on between blocks with the monotonic clock; so it does when blocks
    stop coming, until they return. In lock-step it stands still between blocks. It never goes back.
    """

    QUIET_S = 0.1
    """An unpaced stream without a block for so long has stopped."""
    GONE_S = 0.25
    """A paced one."""

    def __init__(self, rate_hz: float, paced: bool, lockstep: bool = False) -> None:
        self._rate_hz = rate_hz
        self._paced = paced
        self._lockstep = lockstep
        self._host_s: float | None = None
        self._latest = 0.0
        self.end = 0
        """Index after the last sample received."""

    def observe(self, end: int, host_s: float) -> None:
        """Samples up to before `end` were there at `host_s`."""
        self.end = end
        self._host_s = host_s

    def now(self, host_s: float) -> float:
        """Seconds on the stream."""
        if self._host_s is None:
            return 0.0
        since_s = host_s - self._host_s
        if self._lockstep:
            since_s = 0.0
        elif not self._paced:
            since_s -= self.QUIET_S
        self._latest = max(self._latest, self.end / self._rate_hz + max(0.0, since_s))
        return self._latest

    def index(self, host_s: float) -> int:
        """The index that is now on its way."""
        return round(self.now(host_s) * self._rate_hz)

    def is_gone(self, host_s: float) -> bool:
        """Whether a paced stream has begun and delivers no more."""
        return self._paced and self._host_s is not None and host_s - self._host_s > self.GONE_S
