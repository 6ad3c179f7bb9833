"""The FRAMEs that robots tell with their plans, and whether they are those of our schedule."""

from collections.abc import Collection

from sdrlinkd.link.access.sightings import Sightings, schedule_notices
from sdrlinkd.wire import Frame


class HeardFrames:
    """Whose plan the next GRANT tells: the robots `nodes` keep the schedule with this number."""

    def __init__(self, nodes: Collection[int], schedule: int) -> None:
        self._nodes = nodes
        self.schedule = schedule
        """What identifies our schedule."""
        self._last: tuple[int, float, Frame] | None = None
        """The last FRAME of our schedule, as (who told it, when, what)."""
        self._strangers, self._outsiders = Sightings(), Sightings()

    def take(self, src: int, frame: Frame, at: float) -> None:
        """Take the FRAME that robot `src` told in a burst at `at`."""
        self._last = None
        if src not in self._nodes or frame.root not in self._nodes:
            # It may be anybody's; those in `nodes` are who share the channel.
            self._outsiders.add(src, at)
        elif frame.schedule != self.schedule:
            self._strangers.add(src, at)
        else:
            self._strangers.clear(src)
            self._last = src, at, frame

    def of(self, src: int, at: float) -> Frame | None:
        """The FRAME to which a GRANT of robot `src` belongs, in a burst at `at`."""
        if self._last is None or self._last[:2] != (src, at):
            return None
        return self._last[2]

    def notices(self, state: str, now: float) -> list[str]:
        """Sentences on robots that keep another schedule; `state` describes ours."""
        return schedule_notices(self._outsiders, self._strangers, state, now)
