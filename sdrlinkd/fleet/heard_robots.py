"""The robots that a gateway hears, or heard a moment ago."""

import logging
from collections.abc import Callable, Iterator, Sequence
from math import inf

from sdrlinkd.fleet.election import Election, score
from sdrlinkd.fleet.forwarding import Forwarding
from sdrlinkd.fleet.heard_robot import HeardRobot
from sdrlinkd.reports import NeighborReport

PRESENT_S = 3.0
"""Time in s after which a robot that is silent is not heard any more."""
FORGOTTEN_S = 30.0

_log = logging.getLogger(__name__)


class HeardRobots:
    """Each robot by its id; times in s of one monotonic clock.

    `opened` is called with a robot that is new, and returns what to call when it is forgotten.
    """

    def __init__(
        self, own_id: int, lease_s: float, opened: Callable[[int], list[Callable[[], None]]]
    ) -> None:
        self._own_id = own_id
        self._lease_s = lease_s
        self._opened = opened
        self._robots: dict[int, HeardRobot] = {}

    def __iter__(self) -> Iterator[HeardRobot]:
        return iter(list(self._robots.values()))

    def get(self, robot: int | None) -> HeardRobot | None:
        """A robot; None if it is not heard."""
        return None if robot is None else self._robots.get(robot)

    def heard(self, robot: int, now: float) -> HeardRobot:
        """Note that a robot was heard at `now`."""
        known = self._robots.get(robot)
        if known is None:
            election = Election(self._own_id, self._lease_s, now)
            known = self._robots[robot] = HeardRobot(robot, election, Forwarding(), now)
            known.ends = self._opened(robot)
            _log.info("robot %d is heard", robot)
        known.heard_at = now
        return known

    def is_near(self, robot: int) -> bool:
        """Whether a robot is on the air of this gateway's daemon, as it is itself."""
        known = self._robots.get(robot)
        return robot == self._own_id or (known is not None and known.election.score is not None)

    def note(self, neighbors: Sequence[NeighborReport], now: float) -> None:
        """Take how well the daemon hears robots; those that were silent for long are forgotten."""
        scores = {
            each.src: score(each.per if each.per_lately is None else each.per_lately, each.snr_db)
            for each in neighbors
            if each.last_heard_s_ago < PRESENT_S
        }
        for robot in scores:
            self.heard(robot, now)
        for known in self:
            known.election.hear(scores.get(known.id), now)
            if now > known.heard_at + FORGOTTEN_S:
                del self._robots[known.id]
                for end in known.ends:
                    end()
                _log.info("robot %d has not been heard for %d s", known.id, FORGOTTEN_S)

    @property
    def due_at(self) -> float:
        """When a message that is held is due, in s."""
        return min((each.forwarding.due_at for each in self), default=inf)
