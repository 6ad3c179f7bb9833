"""The other gateways of a fleet, the robots that they hear, and who bridges, by their tokens."""

from collections.abc import Callable

from sdrlinkd.fleet.keys import Token


class OtherGateways:
    """What the tokens say that are there."""

    def __init__(self, own_id: int) -> None:
        self._own_id = own_id
        self._there: set[int] = set()
        self._hear: set[tuple[int, int]] = set()
        """(gateway, robot that it hears)."""
        self._bridge: set[int] = set()

    @property
    def ids(self) -> list[int]:
        """The gateways that are there."""
        return sorted(self._there)

    def note(self, token: Token, *, is_there: bool) -> None:
        """Note that a token has come or gone."""
        gateway, robot, bridges = token
        if robot is not None:
            (self._hear.add if is_there else self._hear.discard)((gateway, robot))
        elif bridges:
            (self._bridge.add if is_there else self._bridge.discard)(gateway)
        else:
            (self._there.add if is_there else self._there.discard)(gateway)

    def has_bridge_before(self, is_near: Callable[[int], bool]) -> bool:
        """Whether one of those that bridge on the same air goes before this one."""
        return any(each < self._own_id and is_near(each) for each in self._bridge)

    def rank(self, robot: int, leader: int | None) -> int:
        """How many gateways put before this one what the leader for a robot missed."""
        return sum(
            heard == robot and gateway < self._own_id and gateway != leader
            for gateway, heard in self._hear
        )
