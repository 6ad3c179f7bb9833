"""Filters with a common interface: exchanges in, local minus remote time out."""

from collections import deque
from collections.abc import Callable
from typing import Protocol

from benchmarks.timesync.streams import AIR_S, Exchange
from sdrlinkd.link import DualEnvelope, PaperFilter


class Filter(Protocol):
    """A clock filter; `offset` at a local time in s is None while it has no estimate."""

    def take(self, exchange: Exchange) -> None:
        """Take one more exchange, or the part of it that arrived."""

    def offset(self, now: float) -> float | None:
        """Local minus remote time, in s."""


class Ours:
    """The dual envelope; knows the airtime, and needs no pairs of stamps."""

    def __init__(self, resolution_s: float = 2e-5, airtime_s: float = AIR_S) -> None:
        self.envelope = DualEnvelope(resolution_s)
        self._airtime_s = airtime_s

    def take(self, exchange: Exchange) -> None:
        """Take either direction on its own."""
        t1, t2, t3, t4 = exchange
        if t2 is not None:
            self.envelope.was_heard(t1, t2, self._airtime_s)
        if t3 is not None and t4 is not None:
            self.envelope.heard(t3, t4, self._airtime_s)
        self.envelope.solve(max(t1, t4 or t1))

    def offset(self, now: float) -> float | None:
        """The last estimate, extrapolated to `now`."""
        found = self.envelope.estimate
        return None if found is None else found.offset(now)

    def bound(self, now: float) -> float:
        """A bound on the error at `now`."""
        found = self.envelope.estimate
        return float("inf") if found is None else found.bound(now)


class Paper:
    """Algorithm 3 with four stamps, in its favour: the other robot's turnaround is excluded."""

    def __init__(self) -> None:
        self.filter = PaperFilter()

    def take(self, exchange: Exchange) -> None:
        """Take an exchange if it is complete."""
        t1, t2, t3, t4 = exchange
        if t2 is not None and t3 is not None and t4 is not None:
            self.filter.update_four(1e6 * t1, 1e6 * t2, 1e6 * t3, 1e6 * t4)

    def offset(self, now: float) -> float | None:  # noqa: ARG002
        """The estimate of the last exchange, even before convergence."""
        return 1e-6 * self.filter.offset_estimated if self.filter.n else None


class Px4(Paper):
    """Algorithm 3 with three stamps, as printed and as in PX4."""

    def take(self, exchange: Exchange) -> None:
        """Take an exchange if it is complete."""
        t1, t2, _, t4 = exchange
        if t2 is not None and t4 is not None:
            # Remote stamps start from a time long ago, so that none is negative.
            t1, t2, t4 = (1e6 * (each + 1000) for each in (t1, t2, t4))
            self.filter.update(t1, t2, t4)


class NtpLike:
    """RFC 5905's clock filter (section 10: the least delay of the last eight), and a loop."""

    STAGES = 8
    PHASE, FREQUENCY = 0.5, 0.05

    def __init__(self) -> None:
        self._last: deque[tuple[float, float, float]] = deque(maxlen=self.STAGES)
        self._used = -float("inf")
        self._at = 0.0
        self._offset: float | None = None
        self._skew = 0.0

    def take(self, exchange: Exchange) -> None:
        """Take an exchange if it is complete."""
        t1, t2, t3, t4 = exchange
        if t2 is None or t3 is None or t4 is None:
            return
        self._last.append(((t4 - t1) - (t3 - t2), t4, ((t1 + t4) - (t2 + t3)) / 2))
        _, at, observed = min(self._last)
        if at <= self._used:
            return
        known, passed_s, self._used = self.offset(at), at - self._at, at
        if known is None or abs(observed - known) > 0.128:
            self._offset, self._skew = observed, 0.0
        else:
            self._offset = known + self.PHASE * (observed - known)
            self._skew += self.FREQUENCY * (observed - known) / max(passed_s, 1.0)
        self._at = at

    def offset(self, now: float) -> float | None:
        """The last estimate, extrapolated to `now`."""
        return None if self._offset is None else self._offset + self._skew * (now - self._at)


PEERS: dict[str, Callable[[], Filter]] = {
    "paper_four_stamps": Paper,
    "px4_three_stamps": Px4,
    "ntp_like": NtpLike,
}
