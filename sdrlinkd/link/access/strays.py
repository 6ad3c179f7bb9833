"""Robots that send outside of the turns that they were given, and so use another policy."""

from sdrlinkd.link.access.sightings import FORGET_S

MOST = 20
"""Bursts outside of their turns from which a robot takes part in no plan."""
WEIGHT = 4
"""How many of these a burst within a turn outweighs: by chance, few come within one."""


class Strays:
    """Counts the bursts of each robot; few may come from plans that we have not heard."""

    def __init__(self) -> None:
        self._counted: dict[int, tuple[int, float]] = {}
        """By robot, bursts outside of turns, and when the last burst was heard."""

    def heard(self, src: int, at: float, *, has_turn: bool) -> None:
        """Note a burst of robot `src` at `at`, and whether it has a turn then."""
        n, last = self._counted.get(src, (0, at))
        if at == last and src in self._counted:
            # Another PDU of the same burst.
            return
        n = n if at < last + FORGET_S else 0
        self._counted[src] = (max(0, n - WEIGHT) if has_turn else min(n + 1, 2 * MOST)), at

    def notices(self, now: float) -> list[str]:
        """Sentences on robots that send in no turns."""
        return [
            f"robot {src} sends outside of the turns that it is given: their bursts collide; give "
            "both the same [access], and radios of one kind where access.policy is auto"
            for src, (n, at) in sorted(self._counted.items())
            if n >= MOST and now < at + FORGET_S
        ]
