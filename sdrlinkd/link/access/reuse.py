"""Turns that go on at once, as nobody hears more than one of them.

Two robots are *apart* if neither hears the other, and nobody hears both: there are three hops or
more between them. What one of them sends does not disturb the other's receivers.
"""

from collections.abc import Iterable, Mapping, Sequence

from sdrlinkd.link.access.turns import Ticks
from sdrlinkd.link.paths import Edges
from sdrlinkd.wire import MAX_AIR

Told = tuple[int, int]
"""(robot, ticks) of a turn."""
Stage = tuple[Told, ...]
"""Turns that begin at once, shorter ones first."""


class Apart:
    """Which robots of a team with these links are apart, as far as their links are known."""

    def __init__(self, edges: Edges) -> None:
        self.near: dict[int, set[int]] = {}
        """Each robot, and those that it hears or that hear it."""
        for one, others in edges.items():
            for other in others:
                self.near.setdefault(one, {one}).add(other)
                self.near.setdefault(other, {other}).add(one)

    def __call__(self, one: int, other: int) -> bool:
        """Whether two robots may send at once."""
        near, far = self.near.get(one), self.near.get(other)
        return near is not None and far is not None and near.isdisjoint(far)


NONE_APART = Apart({})


def stages(
    turns: Sequence[Told], uses: Mapping[int, int], apart: Apart, parents: Mapping[int, int],
    ticks: Ticks, most: int,
) -> list[Stage]:  # fmt: skip
    """The turns of a round in order, two at once where their robots are apart.

    The shorter one of two becomes as long as the other one, or as what its robot `uses`, in ticks.
    No turn comes before that of the robot in `parents` that tells of it. The stages take `most`
    pairs of octets at most, unless there are more turns than that.
    """
    left, found = list(turns), list[Stage]()
    room, longest = most - len(turns), MAX_AIR - ticks.guards

    def at_once(one: Told, other: Told) -> Stage:
        """Two turns, each as long as is of use."""
        both = min(max(one[1], other[1]), longest)
        return beside(*((node, max(n, min(both, uses.get(node, 0)))) for node, n in (one, other)))

    while left:
        first, *left = left
        pairs = [
            (at_once(first, turn), -i)
            for i, turn in enumerate(left)
            if apart(first[0], turn[0])
            and min(first[1], turn[1]) <= longest
            and parents.get(turn[0]) not in {node for node, _ in (first, *left[:i])}
        ]
        if not pairs or room < 1:
            found.append((first,))
            continue
        room -= 1
        stage, i = max(pairs, key=lambda pair: (pair[0][0][1], pair[1]))
        del left[-i]
        found.append(stage)
    return found


def beside(*turns: Told) -> Stage:
    """These turns as a stage."""
    return tuple(sorted(turns, key=lambda turn: turn[1]))


def told(found: Iterable[Stage], ticks: Ticks) -> list[Told]:
    """The stages as GRANT tells them: between two turns that begin at once, it goes back."""
    pairs: list[Told] = []
    for stage in found:
        for i, turn in enumerate(stage):
            if i:
                pairs.append((stage[i - 1][1] + ticks.guards, 0))
            pairs.append(turn)
    return pairs
