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
        self._latest = 0.0
        self._seen: tuple[int, float] | None = None

    @property
    def end(self) -> int:
        """Index after the last sample received."""
        return 0 if self._seen is None else self._seen[0]

    def observe(self, end: int, host_s: float) -> None:
        """Samples up to before `end` were there at `host_s`; told from any thread."""
        self._seen = end, host_s

    def now(self, host_s: float) -> float:
        """Seconds on the stream."""
        if self._seen is None:
            return 0.0
        end, seen_s = self._seen
        since_s = host_s - seen_s
        if self._lockstep:
            since_s = 0.0
        elif not self._paced:
            since_s -= self.QUIET_S
        self._latest = max(self._latest, end / self._rate_hz + max(0.0, since_s))
        return self._latest

    def index(self, host_s: float) -> int:
        """The index that is now on its way."""
        return round(self.now(host_s) * self._rate_hz)

    def is_gone(self, host_s: float) -> bool:
        """Whether a paced stream has begun and delivers no more."""
        seen = self._seen
        return self._paced and seen is not None and host_s - seen[1] > self.GONE_S
