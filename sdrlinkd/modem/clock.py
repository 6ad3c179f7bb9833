"""A clock that runs by the received samples: `now` is the sample index over the sample rate."""


class StreamClock:
    """Seconds since index 0 of a stream; `host_s` is the monotonic clock at each call.

    Until the first block the clock stands at 0. If `began_s` is given, on the monotonic clock, it
    runs from there instead.

    Between the blocks of a paced stream, and when blocks stop coming, the clock runs with the
    monotonic clock, aligned to the recent block with the shortest delay. In lock-step it stands
    still between blocks. It never goes back.
    """

    QUIET_S = 0.1
    """Time in s without a block after which an unpaced stream has stopped."""
    GONE_S = 0.25
    """Time in s without a block after which a paced stream has stopped."""
    LATELY_S = 0.25
    """Span in s; the shortest delay is taken over the last one to two spans, in which crystals
    drift apart by some µs."""

    def __init__(
        self,
        rate_hz: float,
        paced: bool,
        lockstep: bool = False,
        began_s: float | None = None,
    ) -> None:
        self._began_s = began_s
        self._rate_hz = rate_hz
        self._paced = paced
        self._lockstep = lockstep
        self._latest = 0.0
        self._seen: tuple[int, float, float] | None = None
        self._before = self._least = float("inf")
        self._until = float("-inf")

    @property
    def end(self) -> int:
        """Index after the last sample received."""
        return 0 if self._seen is None else self._seen[0]

    def observe(self, end: int, host_s: float) -> None:
        """Note that the samples before `end` had arrived at `host_s`; one thread at a time."""
        late_s = host_s - end / self._rate_hz
        if host_s >= self._until:
            self._before, self._least = self._least, late_s
            # After a whole span without blocks, the earlier shortest delay is too old.
            if host_s >= self._until + self.LATELY_S:
                self._before = late_s
            self._until = host_s + self.LATELY_S
        else:
            self._least = min(self._least, late_s)
        self._seen = end, host_s, min(self._before, self._least)

    def now(self, host_s: float) -> float:
        """Time in s on the stream's clock."""
        if self._seen is None:
            if self._began_s is not None:
                self._latest = max(self._latest, host_s - self._began_s)
            return self._latest
        end, seen_s, least_s = self._seen
        if self._lockstep:
            now = end / self._rate_hz
        elif self._paced:
            now = max(end / self._rate_hz, host_s - least_s)
        else:
            now = end / self._rate_hz + max(0.0, host_s - seen_s - self.QUIET_S)
        self._latest = max(self._latest, now)
        return self._latest

    def index(self, host_s: float) -> int:
        """Index of the sample that is on the air now."""
        return round(self.now(host_s) * self._rate_hz)

    def is_gone(self, host_s: float) -> bool:
        """Whether a paced stream had started and no longer delivers blocks."""
        seen = self._seen
        return self._paced and seen is not None and host_s - seen[1] > self.GONE_S
