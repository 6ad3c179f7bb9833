"""Decides when the topics that this robot declares are told to other robots."""

from collections.abc import Iterator
from math import inf

from sdrlinkd.link.topics.own import OwnTopics
from sdrlinkd.wire import Description, TopicPiece, pieces

TIMES_S = (0.0, 0.2, 0.7, 1.5, 3.0, 6.0)
"""When a new declaration, or all of them for a new robot, is told, in s from then."""
PERIOD_S = 10.0
"""Time in s after which each declaration is told again."""
TELLING_SHARE = 0.02
"""Largest share of airtime for declarations in PDUs of their own."""
MOST_CREDIT_S = 0.2
FIRST_CREDIT_S = 0.05


class TopicTeller:
    """Times TOPIC records: at once and a little later, to every new robot, and now and then.

    `room` is the largest piece of a description in octets.
    """

    def __init__(self, topics: OwnTopics, room: int) -> None:
        self.topics = topics
        """The topics that are told."""
        self._room = room
        self._due_at: dict[int, list[float]] = {}
        """Times at which each number is to be told, the earliest first."""
        self._said: dict[int, Description] = {}
        self._version = 0
        self._next_at = inf
        self._credit_s = FIRST_CREDIT_S
        self._looked_at: float | None = None

    def newcomer(self, now: float) -> None:
        """Tell all declarations again, as a robot was heard for the first time."""
        for number in self._due_at:
            self._plan(number, now)

    def due(self, now: float) -> Iterator[TopicPiece]:
        """The records to be told at `now`."""
        if self._version != self.topics.version:
            self._version = self.topics.version
            for number in self._due_at.keys() - self.topics.told.keys():
                del self._due_at[number], self._said[number]
            for number, about in self.topics.told.items():
                if self._said.get(number) != about:
                    self._said[number] = about
                    self._plan(number, now)
        if now < self._next_at:
            return
        for number, times in self._due_at.items():
            if times[0] <= now:
                del times[0]
                if not times:
                    times.append(now + PERIOD_S)
                yield from pieces(number, self._said[number], self._room)
        self._next_at = min(times[0] for times in self._due_at.values())

    def may_pay(self, now: float, cost_s: float) -> bool:
        """Whether a PDU of only such records, of airtime `cost_s`, is within the share at `now`.

        If so, it is charged.
        """
        passed_s = 0.0 if self._looked_at is None else max(0.0, now - self._looked_at)
        self._looked_at = now
        self._credit_s = min(MOST_CREDIT_S, self._credit_s + TELLING_SHARE * passed_s)
        if self._credit_s < 0 or cost_s == inf:
            return False
        self._credit_s -= cost_s
        return True

    def _plan(self, number: int, now: float) -> None:
        self._due_at[number] = [now + each_s for each_s in TIMES_S]
        self._next_at = min(self._next_at, now)
