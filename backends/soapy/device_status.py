"""Whether the device is present, and what its radio processes have counted so far."""

from collections import Counter

from backends.soapy.protocol import CountersReport


class DeviceStatus:
    """State of one device across its radio processes. Other threads only read it."""

    def __init__(self) -> None:
        self.away = ""
        """Why the device is away; empty while it is present."""
        self.notice = ""
        """An oddity of the device that the radio process reported."""
        self.waits_for = ""
        """Why the device could not be opened for the first time yet."""
        self._before: Counter[str] = Counter()
        self._counted: Counter[str] = Counter(overflows=0, samples_lost=0)
        self.outages = 0
        """How often the device went away."""

    @property
    def counters(self) -> dict[str, int]:
        """Sum of the counts of all radio processes so far."""
        total = Counter(self._before)
        total.update(self._counted)
        return dict(total)

    @property
    def trouble(self) -> str:
        """Why the device delivers nothing while it is away or not present yet; else empty."""
        if self.away:
            return f"{self.away}; the daemon retries until it is back"
        return self.waits_for

    @property
    def told(self) -> str:
        """News about the device, in words for people; empty if there are none."""
        return f"gone ({self.away}), retrying until it is back" if self.away else self.notice

    def counted(self, report: CountersReport) -> None:
        """Store what the running process has counted; each process counts from 0."""
        self._counted, self.notice = Counter(report.counters), report.notice

    def waits(self, reason: str) -> None:
        """Note why the device cannot be opened yet; an empty reason keeps the previous one."""
        self.waits_for = reason or self.waits_for

    def waits_no_more(self) -> None:
        """Note that the first opening has ended."""
        self.waits_for = ""

    def came_back(self) -> None:
        """Note that the device is present again."""
        self.away = ""

    def went(self, reason: str) -> bool:
        """Note that the device is gone; False if that is already known."""
        if self.away:
            return False
        self.away = reason
        self.outages += 1
        self._before.update(self._counted)
        self._counted.clear()
        return True
