"""Everything that the page shows: daemons, what they report, and the paths of robots."""

import asyncio
import time
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, Protocol

from sdrlinkd.reports import Snapshot
from sdrlinkd.web.air_log import AirLog
from sdrlinkd.web.history import History
from sdrlinkd.web.positions import PREFERENCE, position_in
from sdrlinkd.web.track import Track

MOST_TRACKS = 512
"""Paths that are kept; further ones are not drawn."""
LOOKS_S = 2.0
"""Time in s after a look at the air for which the daemon goes on to tell of it."""
AWAY_S = 3.0
"""Time in s without a report after which a daemon counts as away."""


class Ask(Protocol):
    """Asks a daemon; raises NoDaemonError and RefusedError."""

    async def __call__(self, verb: str, arguments: dict[str, Any] | None = None) -> Any: ...  # noqa: ANN401


@dataclass
class Station:
    """One daemon that is watched; `name` is shown where it has not said its robot's id."""

    name: str
    ask: Ask | None = None
    """Asks its control socket; None: it is not within reach."""
    snapshot: Snapshot | None = None
    at: float = float("-inf")
    """When the last report came, in s."""
    _air_wanted_at: float = float("-inf")
    history: History = field(default_factory=History)
    air: AirLog = field(default_factory=AirLog)

    @property
    def robot(self) -> int | None:
        """Id of its robot; None until it has said it."""
        return None if self.snapshot is None else self.snapshot.node

    def report(self, snapshot: Snapshot, now: float) -> None:
        """Take a report."""
        self.snapshot, self.at = snapshot, now

    def look_at_air(self, now: float) -> None:
        """Note that somebody looks at the air there."""
        self._air_wanted_at = now

    def wants_air(self, now: float) -> bool:
        """Whether somebody has looked at the air there lately."""
        return now < self._air_wanted_at + LOOKS_S

    def is_away(self, now: float) -> bool:
        """Whether it has not reported lately."""
        return now > self.at + AWAY_S


class World:
    """What is known of all stations and robots; times in s of one monotonic clock."""

    def __init__(self) -> None:
        self.stations: dict[str, Station] = {}
        """By a key that stays the same."""
        self.sent: dict[int, Track] = {}
        """The paths that robots publish, where their own daemon is watched."""
        self.received: dict[tuple[str, int], Track] = {}
        """The paths of robots as stations received them, by (station, robot)."""

    def station(self, key: str, name: str, ask: Ask | None = None) -> Station:
        """The station with a key, which is made if it is new."""
        if key not in self.stations:
            self.stations[key] = Station(name, ask)
        return self.stations[key]

    def forget(self, key: str) -> None:
        """Forget a station, and what it received."""
        self.stations.pop(key, None)
        for each in [each for each in self.received if each[0] == key]:
            del self.received[each]

    def take_position(
        self, stations: Iterable[str], robot: int, topic: str, kind: str, cdr: bytes, now: float
    ) -> None:
        """Take a message of a robot, as `stations` received it; none: as the robot published it."""
        if kind not in PREFERENCE:
            return
        found = position_in(robot, cdr, kind)
        if found is None:
            return
        tracks = [self._track(station, robot) for station in stations]
        for track in tracks or [self.sent.setdefault(robot, Track())]:
            if track is not None:
                track.add(topic, kind, found, now)

    def _track(self, station: str, robot: int) -> Track | None:
        known = self.received.get((station, robot))
        if known is None and len(self.received) < MOST_TRACKS:
            known = self.received[station, robot] = Track()
        return known

    def end_second(self, now: float, unix_s: float) -> None:
        """Keep what each station reported in the last second."""
        for station in self.stations.values():
            station.history.add(None if station.is_away(now) else station.snapshot, unix_s)


async def each_second(world: World) -> None:
    """Keep histories until cancelled."""
    while True:
        await asyncio.sleep(1.0)
        world.end_second(time.monotonic(), time.time_ns() / 1e9)
