"""A clock that runs by the received samples: `now` is the sample index over the sample rate."""

from typing import NamedTuple


class Seen(NamedTuple):
    """The last block of a stream.

    The samples before index `end` had arrived at monotonic time `host_s`; `late_s` is the shortest
    recent difference between arrival and the samples' own time.
    """

    end: int
    host_s: float
    late_s: float


class BlockTimes:
    """When blocks arrive; `observe` is for one thread at a time, `seen` for any thread."""

    LATELY_S = 0.25
    """Span in s; the shortest delay is taken over the last one to two spans, in which crystals
    drift apart by some µs."""

    def __init__(self, rate_hz: float) -> None:
        self._rate_hz = rate_hz
        self._before = self._least = float("inf")
        self._until = float("-inf")
        self.seen: Seen | None = None
        """The last block; None: no block yet."""

    def observe(self, end: int, host_s: float) -> Seen:
        """Note that the samples before `end` had arrived at `host_s`."""
        late_s = host_s - end / self._rate_hz
        if host_s >= self._until:
            self._before, self._least = self._least, late_s
            # After a whole span without blocks, the earlier shortest delay is too old.
            if host_s >= self._until + self.LATELY_S:
                self._before = late_s
            self._until = host_s + self.LATELY_S
        else:
            self._least = min(self._least, late_s)
        seen = self.seen = Seen(end, host_s, min(self._before, self._least))
        return seen


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

    def now(self, seen: Seen | None, host_s: float) -> float:
        """Time in s on the stream's clock, whose last block is `seen`."""
        if seen is None:
            if self._began_s is not None:
                self._latest = max(self._latest, host_s - self._began_s)
            return self._latest
        if self._lockstep:
            now = seen.end / self._rate_hz
        elif self._paced:
            now = max(seen.end / self._rate_hz, host_s - seen.late_s)
        else:
            now = seen.end / self._rate_hz + max(0.0, host_s - seen.host_s - self.QUIET_S)
        self._latest = max(self._latest, now)
        return self._latest

    def is_gone(self, seen: Seen | None, host_s: float) -> bool:
        """Whether a paced stream had started and no longer delivers blocks."""
        return self._paced and seen is not None and host_s - seen.host_s > self.GONE_S
