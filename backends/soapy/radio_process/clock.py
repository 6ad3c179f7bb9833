"""Converts a device's time to sample indices and back, in integers: floats lose nanoseconds."""

from fractions import Fraction

DRIFT_PPM = 100
"""Upper limit of the drift between two crystals."""


class SampleClock:
    """The time of each sample. Index 0 is the first sample received; `begin` sets its time."""

    def __init__(self, rate_hz: float, is_stamped: bool) -> None:
        self._is_stamped = is_stamped
        per_ns = Fraction(rate_hz) / 10**9
        self._up, self._down = per_ns.numerator, per_ns.denominator
        self._zero_ns: int | None = None
        self._late_ns = self._seen_ns = 0

    @property
    def has_begun(self) -> bool:
        """Whether the first sample has arrived, and with it its time stamp if there are any."""
        return self.knows_time or (not self._is_stamped and self._seen_ns > 0)

    @property
    def knows_time(self) -> bool:
        """Whether the device's time of index 0 is known."""
        return self._zero_ns is not None

    def begin(self, time_ns: int, index: int = 0) -> None:
        """Note that sample `index` arrived at `time_ns` by the device's clock."""
        self._zero_ns = time_ns - self.ns(index)

    def index_at(self, time_ns: int) -> int:
        """Index of the sample nearest to a device time."""
        return self.samples(time_ns - (self._zero_ns or 0))

    def time_ns(self, index: int) -> int:
        """Device time of a sample."""
        return (self._zero_ns or 0) + self.ns(index)

    def samples(self, ns: int) -> int:
        """Number of samples in a time span, rounded."""
        return (2 * ns * self._up + self._down) // (2 * self._down)

    def ns(self, samples: int) -> int:
        """Time in ns that `samples` take, rounded."""
        return (2 * samples * self._down + self._up) // (2 * self._up)

    def saw(self, end: int, host_ns: int) -> None:
        """Note that all samples before `end` had arrived at `host_ns` by this host's clock."""
        late_ns = host_ns - self.ns(end)
        allowed = late_ns
        if self._seen_ns:
            # Deliveries are sometimes late, never early; and crystals drift.
            allowed = self._late_ns + (host_ns - self._seen_ns) * DRIFT_PPM // 10**6
        self._late_ns = min(late_ns, allowed)
        self._seen_ns = host_ns

    def now(self, host_ns: int) -> int:
        """Index of the sample on its way now, estimated from the most punctual deliveries."""
        return self.samples(host_ns - self._late_ns) if self._seen_ns else 0
