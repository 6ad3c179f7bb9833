"""Finds out which topics of other robots consumers here subscribe to."""

from sdrlinkd.bus import Bus
from sdrlinkd.config import Setup
from sdrlinkd.link import Link


class Wanting:
    """Tells the link what the bus's subscriptions mean among the topics that others declare."""

    def __init__(self, setup: Setup, link: Link, bus: Bus) -> None:
        self._setup = setup
        self._link = link
        self._bus = bus
        self._seen: tuple[int, frozenset[bytes]] = (0, frozenset())
        self._frames: dict[int, tuple[int, list[tuple[bytes, int]]]] = {}
        """By robot: the version of what it declares, and the frame and number of each topic."""

    def look(self) -> None:
        """Tell the link, if subscriptions or declarations have changed since the last call."""
        seen = self._link.heard_version, self._bus.filters
        if seen == self._seen:
            return
        self._seen = seen
        filters = tuple(self._bus.filters)
        # What others declare must not cost more with each change.
        self._frames = {
            src: self._frames_of(src, version)
            for src, version in self._link.heard_versions().items()
        }
        self._link.want(
            [
                (src, number)
                for src, (_, frames) in self._frames.items()
                for frame, number in frames
                if frame.startswith(filters)
            ]
        )

    def _frames_of(self, src: int, version: int) -> tuple[int, list[tuple[bytes, int]]]:
        known = self._frames.get(src)
        if known is not None and known[0] == version:
            return known
        topics = self._link.heard_topics_of(src)
        return version, [(self._frame(src, each.name), each.base) for each in topics]

    def _frame(self, src: int, name: str) -> bytes:
        """The topic frame of such messages on the bus."""
        return self._setup.republished(src, name).encode() + b"\0"
