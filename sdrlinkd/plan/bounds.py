"""The longest wait for the air, by access policy, class and number of robots, without the queue.

The wait begins when a message is the next one of its class at its robot, and ends when its PDU has
left. The functions of the policies say where each term comes from. All robots hear each other, no
pulse is missed, and no robot lacks what tells its turns (`Access.lacks`).
"""

import math
from collections.abc import Callable, Mapping
from math import inf
from typing import NamedTuple

from sdrlinkd.link import (
    AUCTION_PATIENCE,
    CLOCK_ERROR_S,
    LEAST_TURNS,
    TURN_STANDS,
    Csma,
    PduLinkTraits,
    Qos,
    Settled,
)
from sdrlinkd.plan.supply import LEVEL, RARE


class AccessBound(NamedTuple):
    """The longest wait in s of class `qos` among `robots` robots; infinity: there is no bound.

    All other robots always have another longest burst: for `first_s`, of less urgent classes, and
    for `all_s`, of the same class. While there is something more urgent, neither holds, unless the
    policy treats both alike.
    """

    robots: int
    policy: str
    qos: str
    first_s: float
    all_s: float
    by_chance: bool = False
    """Whether one message in a hundred waits longer."""


class _Air(NamedTuple):
    """What the bounds of all policies need; times in s."""

    settled: Settled
    traits: PduLinkTraits
    robots: int
    longest_s: float
    one_s: float

    @property
    def missed_s(self) -> float:
        """From a message that has just missed a decision to the start that was decided."""
        traits = self.traits
        return traits.lead_s + traits.ahead_s + traits.react_s


def access_bounds(
    settled: Settled, traits: PduLinkTraits, robots: int, longest_s: float, one_s: float
) -> list[AccessBound]:
    """The bounds of all classes, for bursts of at most `longest_s`, and of `one_s` with one PDU."""
    air = _Air(settled, traits, robots, longest_s, one_s)
    bound_s = _BOUNDS.get(settled.policy, _none_s) if robots > 1 else _none_s
    return [
        AccessBound(
            robots, settled.policy, qos.label, bound_s(air, qos, Qos(min(Qos.BULK, qos + 1))),
            bound_s(air, qos, qos), settled.policy == "csma",
        )
        for qos in Qos
    ]  # fmt: skip


def _none_s(air: _Air, qos: Qos, others: Qos) -> float:  # noqa: ARG001  # as the others
    return inf


def _auction_s(air: _Air, qos: Qos, others: Qos) -> float:
    """A message has missed a challenge, a contest follows, and its winner sends. Then it is ours.

    A contest takes all mini-slots of a round, and the burst begins in the last one. Before the
    challenge after a burst, one mini-slot passes. Where others have something of the same class, we
    challenge after PATIENCE of their bursts. Everybody else may then win before us.
    """
    access = air.settled.access
    if air.traits.tx_window_s < inf:
        return inf
    minislot_s = access.pause_s / 2
    contest_s = access.round_s - minislot_s
    turn_s = air.longest_s + minislot_s + contest_s
    before = AUCTION_PATIENCE + air.robots - 1 if others == qos else 0
    return air.missed_s + contest_s + (1 + before) * turn_s + air.one_s


def _minislot_s(air: _Air, qos: Qos, others: Qos) -> float:
    """A message has missed our mini-slot. A burst of the lower level begins in the last mini-slot.

    After it, all others of our level may come before us, each once. They pass over each other for
    one mini-slot a robot in all. Before each burst of the lower level, the mini-slots of the higher
    one pass.
    """
    minislot_s, n = air.settled.access.pause_s, air.robots
    if air.traits.tx_window_s < inf:
        return inf
    is_low = qos > LEVEL
    higher_s = n * minislot_s * is_low
    bound_s = air.missed_s + 2 * n * minislot_s + air.longest_s
    if is_low == (others > LEVEL):
        bound_s += (n - 1) * (air.longest_s + minislot_s + higher_s)
    return bound_s + n * minislot_s + higher_s + air.one_s


def _tdma_s(air: _Air, qos: Qos, others: Qos) -> float:  # noqa: ARG001  # the same for all
    """A message has missed the last burst of our slot, and waits for the next frame.

    Meanwhile slots may move by what robots' clocks differ. A radio with pauses between its TX
    windows may miss frames.
    """
    traits, round_s = air.traits, air.settled.access.round_s
    frames = 1
    if traits.tx_window_s < inf:
        frames = max(1, math.ceil((air.longest_s + traits.rx_window_s) / round_s))
    return air.missed_s + traits.tx_window_follow_s + frames * round_s + CLOCK_ERROR_S + air.one_s


def _grant_s(air: _Air, qos: Qos, others: Qos) -> float:  # noqa: ARG001  # the same for all
    """A message has missed our turn. The least turns come round, whatever is asked for.

    A turn is left out once if the last one was less than half a budget ago. If all ask for more
    than the budget, at most two robots share that of a round; the others of the turns are least
    ones. In large teams, these go round.
    """
    access = air.settled.access
    round_s = access.round_s
    if air.robots - 1 <= LEAST_TURNS + 1:
        waits_s = 2 * round_s - (1 - TURN_STANDS) * access.share * air.robots * round_s
    else:
        waits_s = (1 + math.ceil((air.robots - 1) / LEAST_TURNS)) * round_s
    return air.missed_s + waits_s + air.one_s


def _csma_s(air: _Air, qos: Qos, others: Qos) -> float:
    """Bursts and idle slots until all but RARE of the messages have begun before the others."""
    access = air.settled.access
    if not isinstance(access, Csma) or air.traits.tx_window_s < inf:
        return inf
    loses = 1 - access.begins_first(qos, others, air.robots - 1)
    bursts = math.ceil(math.log(RARE) / math.log(loses)) if 0 < loses < 1 else 1
    return air.missed_s + bursts * (air.longest_s + access.mean_wait_s(qos)) + air.one_s


_BOUNDS: Mapping[str, Callable[[_Air, Qos, Qos], float]] = {
    "auction": _auction_s,
    "minislot": _minislot_s,
    "tdma": _tdma_s,
    "grant": _grant_s,
    "csma": _csma_s,
}
