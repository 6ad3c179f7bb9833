"""Evaluates a daemon's snapshots, about one per second."""

from sdrlinkd.health.lately import Lately
from sdrlinkd.health.limit import Limiter
from sdrlinkd.health.story import Line, Story
from sdrlinkd.health.verdict import judge
from sdrlinkd.reports import Snapshot, VerdictReport


class Health:
    """The health of one daemon; its time is the snapshots' `uptime_s`."""

    def __init__(self) -> None:
        self._lately = Lately()
        self._story = Story()
        self._limiter: Limiter[Line] = Limiter()
        self.shares_air = False
        """Whether other robots may use the PDU link's channel."""

    def judge(self, snapshot: Snapshot) -> VerdictReport:
        """The verdict on a snapshot, which is not remembered."""
        return judge(snapshot, self._lately, self.shares_air)

    def look(self, snapshot: Snapshot) -> list[Line]:
        """Log lines on changes since the last call; to be called about once a second."""
        now = snapshot.uptime_s
        lines = []
        for line in self._story.tell(snapshot, self._lately):
            passed = self._limiter.take(line.subject, line, now)
            if passed is not None:
                lines.append(passed)
        for line, n in self._limiter.late(now):
            more = f" ({n} similar lines suppressed)" if n else ""
            lines.append(line._replace(text=line.text + more))
        self._lately.note(snapshot)
        return lines

    def passed(self, line: Line, now: float) -> Line | None:
        """`line` on an event at `now`, unless there were too many on its subject.

        The last one of those that are held back is told by `look`, with their number.
        """
        return self._limiter.take(line.subject, line, now)
