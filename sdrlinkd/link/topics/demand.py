"""The topics of this robot that consumers at other robots subscribe to, by their WANTED records."""

from collections.abc import Collection

from sdrlinkd.link.topics.own import OwnTopics
from sdrlinkd.wire import Wanted

LEASE_S = 3.0
"""Time in s for which a WANTED record holds."""


class Demand:
    """Leases of declared topics. A robot that falls silent wants nothing any more."""

    def __init__(self, topics: OwnTopics) -> None:
        self._topics = topics
        self._until: dict[tuple[str, int], float] = {}
        """When the lease of a topic by a robot ends."""
        self._own: tuple[int, frozenset[int]] = (0, frozenset())

    def want_own(self, own_id: int, numbers: Collection[int]) -> None:
        """Note what consumers here want of this robot itself, which hears its own PDUs."""
        self._own = own_id, frozenset(numbers)

    def hear(self, src: int, wanted: Wanted, at: float) -> None:
        """Take what robot `src` wants of this robot. Numbers that nobody declared are ignored."""
        for number in wanted.topics:
            about = self._topics.told.get(number)
            if about is not None:
                self._until[about.name, src] = at + LEASE_S

    def wanted(self, now: float) -> dict[str, list[int]]:
        """The names of the topics that are wanted at `now`, and the robots that want each."""
        self._until = {key: until for key, until in self._until.items() if until > now}
        own_id, numbers = self._own
        own = {(self._topics.told[n].name, own_id) for n in numbers if n in self._topics.told}
        found: dict[str, list[int]] = {}
        for name, src in sorted(self._until.keys() | own):
            found.setdefault(name, []).append(src)
        return found
