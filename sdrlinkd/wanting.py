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

    def look(self) -> None:
        """Tell the link, if subscriptions or declarations have changed since the last call."""
        seen = self._link.heard_version, self._bus.filters
        if seen == self._seen:
            return
        self._seen = seen
        filters = tuple(self._bus.filters)
        self._link.want(
            [
                (src, topic.base)
                for src, topics in self._link.heard_topics().items()
                for topic in topics
                if self._frame(src, topic.name).startswith(filters)
            ]
        )

    def _frame(self, src: int, name: str) -> bytes:
        """The topic frame of such messages on the bus."""
        return self._setup.republished(src, name).encode() + b"\0"
