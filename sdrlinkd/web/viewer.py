"""What one browser looks at."""

import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

from sdrlinkd.web.floor_plan import FloorPlan
from sdrlinkd.web.world import Station, World


@dataclass
class Viewer:
    """The state of one open page."""

    world: World
    may_control: bool
    plan: FloorPlan | None
    chosen: str = ""
    """Key of the station whose view is shown."""
    is_paused: bool = False
    on_choose: list[Callable[[], None]] = field(default_factory=list)

    @property
    def station(self) -> Station | None:
        """The station that is shown: the chosen one, else the first that answers."""
        found = self.world.stations
        if self.chosen not in found:
            alive = [key for key, each in found.items() if not each.is_away(now_s())]
            self.chosen = (alive or list(found) or [""])[0]
        return found.get(self.chosen)

    @property
    def names(self) -> dict[str, str]:
        """What the stations are called, by key."""
        found = self.world.stations.items()
        names = {
            k: f"robot {each.robot}" if each.robot is not None else each.name for k, each in found
        }
        counts = Counter(names.values())
        # Daemons of different teams may have the same id.
        return {k: f"{name} ({k})" if counts[name] > 1 else name for k, name in names.items()}

    def choose(self, key: str) -> None:
        """Show another station."""
        self.chosen = key
        for each in self.on_choose:
            each()


def now_s() -> float:
    """The clock of the world, in s."""
    return time.monotonic()
