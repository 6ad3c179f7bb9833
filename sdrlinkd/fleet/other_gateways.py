"""The other gateways of a fleet, and the robots that they hear, by their tokens."""


class OtherGateways:
    """What the tokens say that are there."""

    def __init__(self, own_id: int) -> None:
        self._own_id = own_id
        self._there: set[int] = set()
        self._hear: set[tuple[int, int]] = set()
        """(gateway, robot that it hears)."""

    @property
    def ids(self) -> list[int]:
        """The gateways that are there."""
        return sorted(self._there)

    def note(self, gateway: int, robot: int | None, *, is_there: bool) -> None:
        """Note that the token of a gateway, or of a robot that it hears, has come or gone."""
        if robot is None:
            (self._there.add if is_there else self._there.discard)(gateway)
        else:
            (self._hear.add if is_there else self._hear.discard)((gateway, robot))

    def rank(self, robot: int, leader: int | None) -> int:
        """How many gateways put before this one what the leader for a robot missed."""
        return sum(
            heard == robot and gateway < self._own_id and gateway != leader
            for gateway, heard in self._hear
        )
