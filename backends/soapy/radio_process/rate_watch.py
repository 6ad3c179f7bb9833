"""Checks by this host's clock whether samples come at the rate that the device reports."""

from backends.soapy.radio_process.clock import SampleClock

SPAN_NS = 5 * 10**9
TOLERANCE = 0.005
"""Relative; no crystal is off by as much."""


class RateWatch:
    """Compares the rate of each time span with the device's rate; samples come in `piece`s."""

    def __init__(self, clock: SampleClock, rate_hz: float, piece: int) -> None:
        self._clock = clock
        self._rate_hz = rate_hz
        self._slack = 2 * piece
        self._begun: tuple[int, int] | None = None
        self.faults = 0
        self.notice = ""

    def saw(self, end: int, host_ns: int) -> None:
        """Note that all samples before `end` had arrived, or were missing, at `host_ns`."""
        if self._begun is None:
            self._begun = end, host_ns
            return
        begin, begun_ns = self._begun
        if host_ns - begun_ns < SPAN_NS:
            return
        due, came = self._clock.samples(host_ns - begun_ns), end - begin
        self._begun = end, host_ns
        if abs(came - due) <= TOLERANCE * due + self._slack:
            self.notice = ""
            return
        self.faults += 1
        rate = came / due * self._rate_hz / 1e6
        self.notice = (
            f"samples arrive at {rate:.3g} Msps, but the device claims {self._rate_hz / 1e6:g}: "
            "try another rate or another driver"
        )
