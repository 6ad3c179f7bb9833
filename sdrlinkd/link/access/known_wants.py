"""What each robot has told that it wants, and when each of them was last on the air."""

from collections.abc import Iterable
from math import inf
from typing import NamedTuple

from sdrlinkd.link.access.always_urgent import AlwaysUrgent
from sdrlinkd.link.access.requests import Waiting
from sdrlinkd.link.access.team import PRESENT_S
from sdrlinkd.link.qos import Qos

WANTED_S = 1.0
"""Time in s for which what a robot has told counts."""


class Wanted(NamedTuple):
    """The most urgent message of robot `node`, as it told it at `at`, in s."""

    qos: Qos
    priority: int
    node: int
    at: float

    def is_before(self, qos: Qos, priority: int) -> bool:
        """Whether this is as urgent as a message of that class and priority, or more."""
        return (self.qos, -self.priority) <= (qos, -priority)


class KnownWants:
    """What is known of the robots `nodes`; those that heard the same bursts know the same."""

    def __init__(self, own_id: int, nodes: Iterable[int]) -> None:
        self._nodes = frozenset(nodes)
        self.urgent = AlwaysUrgent(own_id, len(self._nodes))
        """Who always wants urgent; air counts in bursts."""
        self._wanted: dict[int, Wanted] = {}
        self._on_air_at: dict[int, float] = {}
        """When each robot was on the air last."""
        self._burst_of: dict[int, int] = {}
        """The number of the last burst of each robot."""
        self.n_bursts = 0
        """Count of bursts so far."""
        self._missed_at = -inf
        self._began_at: float | None = None
        """Time of the first burst."""

    def on_air(self, node: int, at: float) -> bool:
        """Note a burst of a robot at `at`; returns whether it is a new one.

        `at` is when it began or, for one of our own, when it ends.
        """
        self._begin(at)
        if node not in self._nodes or at <= self._on_air_at.get(node, -inf):
            return False
        self._on_air_at[node] = at
        self.n_bursts += 1
        self._burst_of[node] = self.n_bursts
        self._note_urgent(node, at)
        return True

    def silent_since(self, node: int) -> float:
        """When a robot was on the air last."""
        return self._on_air_at.get(node, -inf)

    def take_back(self, node: int, silent_since: float) -> None:
        """Note that the last burst of a robot has not left; what it wants is not known."""
        self._on_air_at[node] = silent_since
        self.n_bursts -= 1
        self._wanted.pop(node, None)

    def told(self, node: int, waiting: Waiting | None, at: float) -> None:
        """Note what a robot told in a burst that began at `at`; None: it wants nothing."""
        if node not in self._nodes:
            return
        if waiting is None:
            self._wanted.pop(node, None)
        else:
            self._wanted[node] = Wanted(waiting.qos, waiting.priority, node, at)

    def missed(self, at: float) -> None:
        """Note that a burst that ended at `at` could not be read."""
        self._missed_at = at
        self._begin(at)

    def is_unsure(self, own: int, now: float) -> bool:
        """Whether somebody may have told something else meanwhile, in a burst that was missed."""
        if now > self._missed_at + WANTED_S:
            return False
        # Robots that were never heard may be here all the same, for some time.
        began_at = self._missed_at if self._began_at is None else self._began_at
        return any(
            now - PRESENT_S < self._on_air_at.get(node, began_at) <= self._missed_at
            for node in self._nodes
            if node != own
        )

    def of(self, node: int, now: float) -> Wanted | None:
        """What a robot wants, as far as it is known."""
        found = self._wanted.get(node)
        return found if found is not None and now < found.at + WANTED_S else None

    def first(self, now: float) -> Wanted | None:
        """What is the most urgent; of equals, that of the robot that was silent for longest."""
        known = [each for node in self._wanted if (each := self.of(node, now)) is not None]
        return min(known, key=self._rank, default=None)

    def in_order(self) -> list[int]:
        """All robots; whoever was silent for longest comes first."""
        return sorted(self._nodes, key=lambda node: (self._on_air_at.get(node, -inf), node))

    def lacks(self, own: int, qos: Qos, priority: int, now: float) -> bool:
        """Whether the others do not know that our robot wants something as urgent as that."""
        known = self.of(own, now)
        return known is None or not known.is_before(qos, priority)

    def goes_again(self, first: Wanted, priority: int, since_n: int) -> bool:
        """Whether the robot that is next has had the `since_n`-th burst, or a later one.

        This counts if it has more than its share of the air for urgent messages, and for such
        messages of that priority. So a robot that rarely has some need not wait for it.
        """
        is_equal = first.qos is Qos.URGENT and first.priority == priority
        is_again = self._burst_of.get(first.node, -1) >= since_n
        return is_equal and is_again and self.urgent.has_more(first.node)

    def _note_urgent(self, node: int, at: float) -> None:
        """Note a burst of a robot, and who wants urgent meanwhile."""
        urgent = {
            each for each in self._wanted
            if (wanted := self.of(each, at)) is not None and wanted.qos is Qos.URGENT
        }  # fmt: skip
        self.urgent.passed(1)
        if node in urgent:
            self.urgent.had(node, 1)
        self.urgent.look(urgent, at)

    def _begin(self, at: float) -> None:
        if self._began_at is None:
            self._began_at = at

    def _rank(self, wanted: Wanted) -> tuple[Qos, int, float, int]:
        return wanted.qos, -wanted.priority, self.silent_since(wanted.node), wanted.node
