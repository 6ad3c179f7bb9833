"""Whether the device is there, and what its radio processes have counted so far."""

from collections import Counter

from backends.soapy.protocol import CountersReport


class DeviceStatus:
    """The state of one device over all radio processes that had it. Only read by other threads."""

    def __init__(self) -> None:
        self.away = ""
        """Why the device is away; empty while it is there."""
        self.notice = ""
        """What the radio process found odd about it."""
        self.waits_for = ""
        """What keeps it from being opened for the first time."""
        self._before: Counter[str] = Counter()
        self._counted: Counter[str] = Counter(overflows=0, samples_lost=0)
        self.outages = 0
        """How often the device went away."""

    @property
    def counters(self) -> dict[str, int]:
        """The counts of all radio processes so far."""
        total = Counter(self._before)
        total.update(self._counted)
        return dict(total)

    @property
    def trouble(self) -> str:
        """Why nothing comes from it, while it is away or not there yet; else empty."""
        if self.away:
            return f"{self.away}; the daemon retries until it is back"
        return self.waits_for

    @property
    def told(self) -> str:
        """The news about it, in words for people; empty where there are none."""
        return f"gone ({self.away}), retrying until it is back" if self.away else self.notice

    def counted(self, report: CountersReport) -> None:
        """Take what the process has counted; it counts from 0."""
        self._counted, self.notice = Counter(report.counters), report.notice

    def waits(self, reason: str) -> None:
        """Note what keeps the device from being opened; no reason: what is known already."""
        self.waits_for = reason or self.waits_for

    def waits_no_more(self) -> None:
        """Note that opening it for the first time has ended."""
        self.waits_for = ""

    def came_back(self) -> None:
        """Note that the device is there again."""
        self.away = ""

    def went(self, reason: str) -> bool:
        """Note that the device is gone; False where that is known already."""
        if self.away:
            return False
        self.away = reason
        self.outages += 1
        self._before.update(self._counted)
        self._counted.clear()
        return True
