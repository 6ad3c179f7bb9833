"""What the robots of the team would send next, and the order in which they get the air."""

from dataclasses import dataclass
from math import inf
from typing import NamedTuple

from sdrlinkd.link.qos import Qos
from sdrlinkd.wire import (
    AGE_UNIT_S,
    AIR_UNIT_S,
    MAX_AGE,
    MAX_AIR,
    Want,
    code_of,
)


class Due(NamedTuple):
    """An urgent message of robot `node`, which will probably be there at `at`, in s."""

    node: int
    qos: Qos
    at: float
    air_s: float
    """Airtime of the message."""


class Waiting(NamedTuple):
    """What waits at a robot: its most urgent message, and the airtime in s that all of it needs."""

    qos: Qos
    priority: int
    age_s: float
    air_s: float
    """Airtime of the class of that message."""
    lower_air_s: float = 0.0
    """Airtime of all lower classes."""

    @property
    def all_s(self) -> float:
        """Airtime of everything that waits."""
        return self.air_s + self.lower_air_s

    def without(self, sent_s: float) -> "Waiting | None":
        """What is left after `sent_s` of airtime; None: nothing."""
        lower_s = self.lower_air_s - max(0.0, sent_s - self.air_s)
        air_s = self.air_s - sent_s
        if air_s > 0:
            return self._replace(air_s=air_s)
        if lower_s <= 0:
            return None
        return self._replace(qos=Qos.BULK, priority=0, air_s=lower_s, lower_air_s=0.0)


def together(one: Waiting | None, other: Waiting | None) -> Waiting | None:
    """Both of what waits, with the more urgent one first."""
    if one is None or other is None:
        return one or other
    first, second = sorted((one, other), key=rank)
    if first.qos == second.qos:
        return first._replace(
            air_s=first.air_s + second.air_s, lower_air_s=first.lower_air_s + second.lower_air_s
        )
    return first._replace(lower_air_s=first.lower_air_s + second.all_s)


def want_of(node: int, waiting: Waiting) -> Want:
    """The WANT record for what waits at robot `node`."""
    return Want(
        node,
        waiting.qos,
        waiting.priority,
        code_of(waiting.age_s, AGE_UNIT_S, MAX_AGE),
        code_of(waiting.air_s, AIR_UNIT_S, MAX_AIR),
        code_of(waiting.lower_air_s, AIR_UNIT_S, MAX_AIR),
    )


def waiting_of(want: Want) -> Waiting | None:
    """What a WANT record tells; None: nothing waits."""
    if not want.air and not want.lower_air:
        return None
    return Waiting(Qos(want.qos), want.priority, want.age_s, want.air_s, want.lower_air_s)


@dataclass(slots=True)
class _Request:
    waiting: Waiting
    at: float
    since: float
    """When the robot began to ask."""


class Requests:
    """The last request of each robot, less what it has been given since."""

    def __init__(self) -> None:
        self._by_node: dict[int, _Request] = {}

    def take(self, want: Want, at: float) -> None:
        """Take what a robot, or one that forwards its request, has told."""
        waiting = waiting_of(want)
        if waiting is None:
            self._by_node.pop(want.node, None)
        else:
            known = self._by_node.get(want.node)
            since = at if known is None else known.since
            self._by_node[want.node] = _Request(waiting, at, since)

    def given(self, node: int, length_s: float) -> None:
        """Note that a robot was given a turn of this length."""
        request = self._by_node.get(node)
        if request is not None:
            left = request.waiting.without(length_s)
            if left is None:
                del self._by_node[node]
            else:
                request.waiting = left

    @property
    def since(self) -> float:
        """Since when the robot that has waited longest wants something; infinity: nobody does."""
        return min((request.since for request in self._by_node.values()), default=inf)

    def of(self, node: int, now: float) -> Waiting | None:
        """What waits at a robot, as far as known, with its age at `now`."""
        request = self._by_node.get(node)
        if request is None:
            return None
        waiting = request.waiting
        return waiting._replace(age_s=waiting.age_s + now - request.at)


def rank(waiting: Waiting) -> tuple[int, int, float]:
    """The order in which robots get the air: by class, priority and age, the first one first."""
    return waiting.qos, -waiting.priority, -waiting.age_s
