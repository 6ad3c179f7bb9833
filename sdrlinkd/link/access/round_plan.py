"""Plans a round: which robots get a turn, how long, and in which order.

Every robot that is present gets a turn in which a PDU fits, so that it can send something urgent or
ask for more. In teams of more than nine, these turns go round. The robots that want the most
urgent things share a budget of airtime on top of that. Robots that do not hear the root come after
those that may pass the plan on to them. Where links lose much, the root does not know which one
will. So the order is that of the fewest hops, and not that of the best paths.
"""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from math import inf
from struct import pack
from typing import NamedTuple

from sdrlinkd.link.access.requests import Due, Waiting
from sdrlinkd.link.access.reuse import Stage, beside, told
from sdrlinkd.link.access.team import Places
from sdrlinkd.link.access.turns import Ticks
from sdrlinkd.link.qos import MIDDLE_PRIORITY, Qos
from sdrlinkd.wire import ANYBODY, FRAME_SIZE, GRANT_OVERHEAD, MAX_AIR, TURN_SIZE, RecordType, crc16

MOST_TURNS = 8
"""Most robots with a turn in one round, beside the root."""
SPARE_TURNS = 2
"""Turns of a round beyond one for each robot: for those who are not here, and a second one."""
MOST_TOLD = MOST_TURNS + SPARE_TURNS
"""Most turns in a plan."""
PLAN_SIZE = FRAME_SIZE + GRANT_OVERHEAD + MOST_TOLD * TURN_SIZE
"""Most octets of a plan."""
LEAST_TURNS = MOST_TOLD - 1 - 2
"""Least turns of a round in which two robots share the budget; one turn may be for anybody."""
STANDS = 0.5
"""Share of a round's budget that passes between two turns of a robot that does not want any."""


Account = tuple[int, Qos]
"""Airtime is counted by robot and class; default and bulk count as one."""


def account(node: int, qos: Qos) -> Account:
    """Where airtime of a robot for a class is counted."""
    return node, min(qos, Qos.DEFAULT)


class Times(NamedTuple):
    """The times of a schedule, in s."""

    ticks: Ticks
    turn_s: float
    """The least turn: a burst of one PDU."""
    budget_s: float
    """Airtime of a round beyond the least turns."""
    longest_s: float
    """The longest burst."""
    hears_s: float
    """From the last turn until that of the root, which forwards what it has heard."""
    react_s: float
    """From the end of the PDU with the plan until the first turn, at least."""

    def schedule(self, nodes: Collection[int]) -> int:
        """What identifies the schedule of the robots `nodes`."""
        micro = [round(1e6 * each) for each in (*self.ticks, self.turn_s, self.budget_s)]
        return crc16(pack(">BIIII", RecordType.GRANT, *micro) + bytes(sorted(nodes)))

    def round_s(self, n: int) -> float:
        """The longest round of `n` robots, some of which pass plans on, with the root's turn."""
        others = min(n - 1, MOST_TURNS)
        least_s = self.turn_s + self.ticks.guard_s + self.ticks.tick_s
        turns_s = (others + SPARE_TURNS) * least_s + (2 + others) * self.turn_s
        return turns_s + self.budget_s + self.react_s + self.hears_s

    @property
    def root_s(self) -> float:
        """The longest time from the end of a round until the plan of the next one is known."""
        return self.hears_s + 2 * self.turn_s + self.budget_s + self.react_s

    def carries(self, n: int) -> float:
        """Share of the budget in a round of `n` robots that all want more than they get."""
        return self.budget_s / (self.budget_s + self.least_s(n))

    def least_s(self, n: int) -> float:
        """A round of `n` robots that have only their least turns."""
        others = min(n - 1, MOST_TURNS)
        turns_s = others * (self.turn_s + self.ticks.guard_s) + 2 * self.turn_s
        return turns_s + self.react_s + self.hears_s


def shares(
    times: Times,
    waiting: Mapping[int, Waiting],
    had_s: Mapping[Account, float],
) -> dict[int, float]:
    """The airtime in s that each robot gets beyond its least turn, of those that want more.

    They are in order. Nobody's bulk comes before what is urgent for others. Of those with the same
    class and priority, the robot comes first that had the least airtime for that lately, `had_s`.
    So whoever always has something urgent does not go before who rarely has. Among those that had
    none, what is urgent goes by age; a relay does not know the ages of all other messages.
    """
    parts = []
    for node, each in waiting.items():
        had = had_s.get(account(node, each.qos), 0.0)
        since = -each.age_s if each.qos <= Qos.LATENCY else 0.0
        parts.append((each.qos, -each.priority, had, since, node, each.air_s))
        had = had_s.get(account(node, Qos.BULK), 0.0)
        parts.append((Qos.BULK, -MIDDLE_PRIORITY, had, 0.0, node, each.lower_air_s))
    left_s, given = times.budget_s, dict[int, float]()
    for *_, node, part_s in sorted(parts):
        given_s = min(part_s, left_s)
        if given_s > 0 and (node in given or len(given) <= MOST_TURNS):
            given[node] = given.get(node, 0.0) + given_s
            left_s -= given_s
    return given


def plan(
    times: Times,
    begin: float,
    present: Collection[int],
    given: Mapping[int, float],
    places: Places,
    served_at: Mapping[int, float],
    *,
    is_open: bool,
) -> list[tuple[int, int]]:
    """The turns of a round from `begin` on in order, as (robot, ticks), after the root's own.

    `present` are the other robots, `given` what some get beyond the least turn, in order.
    `served_at` tells when each had its last turn. With `is_open`, there is a turn for anybody else.
    """
    count, guard_s = times.ticks.count, times.ticks.guard_s
    tellers = set(places.parents.values())

    def ticks(node: int) -> int:
        """A turn in which a robot can tell what it must, beside what it is given."""
        least_s = times.turn_s * (1 + (node in tellers))
        return min(count(least_s + given.get(node, 0.0)), MAX_AIR)

    def heard(nodes: Sequence[int], before: Collection[int] = ()) -> list[int]:
        """These robots, nearer ones first, and those from which some hear of their turns."""
        found = [node for node in nodes if node in present]
        for node in found:
            by = places.parents.get(node)
            if by is not None and by in present and by not in found and by not in before:
                found.append(by)
        return sorted(found, key=places.order)

    runs = heard([*given])
    turns = [(node, ticks(node)) for node in runs]
    ends = {turn.node: turn.end for turn in times.ticks.round(0, begin, turns).turns}
    end = max(ends.values(), default=begin)
    # Rounds are short while something urgent is due; then not everybody needs a turn in each.
    rest = [
        node
        for node in present
        if ends.get(node, served_at.get(node, -inf)) < end + guard_s - STANDS * times.budget_s
    ]
    # Whoever had no turn for the longest time comes first, if there are too many.
    rest.sort(key=lambda node: (ends.get(node, served_at.get(node, -inf)), node))
    most = min(len(present), MOST_TURNS) + SPARE_TURNS - 1 - len(runs)
    rest = heard(sorted(rest[: max(0, most)]), runs)
    turns += [(node, count(times.turn_s * (1 + (node in tellers)))) for node in rest]
    return [*turns, (ANYBODY, count(times.turn_s))] if is_open else turns


def before(
    dues: Sequence[Due],
    root: int,
    ticks: Ticks,
    begin: float,
    turns: list[Stage],
    turn_s: float,
    kept: Mapping[int, int],
) -> list[Stage]:
    """The turns of a round from `begin` on, changed so that messages find turns when they are due.

    `dues` are in order of time. The robot that the first one comes from gets the last turn, so that
    the root can forward it at once; so do those of messages that are due together with it. Other
    turns end before: they become as short as `turn_s`, or are left out if the first message comes
    too soon for that. But robots in `kept` keep so many ticks.
    If the round is over long before, it stays as it is.
    """
    first, least = dues[0], ticks.count(turn_s)

    def end_of(found: list[Stage]) -> float:
        return ticks.round(0, begin, told(found, ticks)).end

    def shorter(node: int, length: int, over_s: float) -> tuple[int, int]:
        """A turn without what is over, as far as its robot does not keep that."""
        shortest = min(length, max(least, kept.get(node, 0)))
        return node, max(shortest, length - ticks.count(over_s))

    rest = _those(turns, lambda node, length: node != first.node or length > 2 * least)

    if end_of(rest) < first.at - 2 * turn_s:
        return turns
    if first.at < begin + 2 * turn_s:
        rest = _those(rest, lambda node, _: node in kept)
    for i in range(len(rest) - 1, -1, -1):
        over_s = end_of(rest) - first.at
        if over_s > 0:
            rest[i] = beside(*(shorter(*turn, over_s) for turn in rest[i]))
    for due in dues:
        at = end_of(rest)
        if due.at > at + 2 * turn_s and due is not first:
            break
        if due.node == root:
            # The root has the next turn anyway.
            continue
        if due.at > at:
            # A turn of the root, which it does not use: nobody begins something else.
            pause = max(1, int((due.at - at - ticks.guard_s) / ticks.tick_s))
            rest.append(((root, min(pause, MAX_AIR)),))
        rest.append(((due.node, min(ticks.count(due.air_s), MAX_AIR)),))
    return rest


def _those(turns: Iterable[Stage], suits: Callable[[int, int], bool]) -> list[Stage]:
    kept = (tuple(turn for turn in stage if suits(*turn)) for stage in turns)
    return [stage for stage in kept if stage]
