"""Whether samples come as fast as the device says, by this host's clock."""

from backends.soapy.radio_process.clock import SampleClock

SPAN_NS = 5 * 10**9
TOLERANCE = 0.005
"""No crystal is so far off."""


class RateWatch:
    """Compares the rate of each span with the device's word; samples come in pieces of `piece`."""

    def __init__(self, clock: SampleClock, rate_hz: float, piece: int) -> None:
        self._clock = clock
        self._rate_hz = rate_hz
        self._slack = 2 * piece
        self._begun: tuple[int, int] | None = None
        self.faults = 0
        self.notice = ""

    def saw(self, end: int, host_ns: int) -> None:
        """Note that all samples before `end` were there, or missing, at `host_ns`."""
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
