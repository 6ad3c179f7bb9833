"""Compares the host's clock with the link's clock, and feeds chronyd with another robot's clock."""

import time
from typing import TYPE_CHECKING

from sdrlinkd.link import Link, State, Wall
from sdrlinkd.localtime import host_clocks

if TYPE_CHECKING:
    # Its package imports the bag readers, which the daemon on a robot does not need.
    from sdrlinkd.adapters import ChronySocket

CHRONY_S = 1.0
SET_S = 0.1
"""A jump of the host's clock by this much, in s, means that somebody set it."""
LEAST_ERROR_S = 5e-5


class HostClock:
    """Reports this host's clock to `link`, and the clock of `robot` to `chrony`."""

    def __init__(self, link: Link, chrony: "ChronySocket | None", robot: int) -> None:
        self._link = link
        self._chrony = chrony
        self._robot = robot
        self._chrony_at = 0.0
        self._wall_ns: int | None = None
        self._ahead_ns: int | None = None
        self._error_s = 0.0
        self.steps = 0
        """How often the host's clock was set since the start."""

    def look(self, now: float) -> None:
        """Measure how far the host's clock is ahead of the link's at `now`, and how that varies."""
        wall_ns = time.time_ns() - round(1e9 * now)
        if self._wall_ns is not None:
            moved_s = 1e-9 * abs(wall_ns - self._wall_ns)
            # Setting the clock does not make it less exact.
            if moved_s < SET_S:
                self._error_s = max(moved_s, 0.95 * self._error_s)
        self._wall_ns = wall_ns
        # The link's time may jump, too, so detect steps by a clock that is never set.
        host_ns, own_ns = host_clocks()
        ahead_ns = host_ns - own_ns
        if self._ahead_ns is not None and 1e-9 * abs(ahead_ns - self._ahead_ns) >= SET_S:
            self.steps += 1
        self._ahead_ns = ahead_ns
        self._link.set_wall(Wall(wall_ns, self._error_s + LEAST_ERROR_S))
        if self._chrony is not None and time.monotonic() - self._chrony_at >= CHRONY_S:
            self._chrony_at = time.monotonic()
            self._tell(self._chrony, now)

    def _tell(self, chrony: "ChronySocket", now: float) -> None:
        known = self._link.wall_offset(self._robot, now)
        if known is not None and self._link.clock_state(self._robot, now) is State.SYNCED:
            chrony.send(time.time_ns(), -1e-9 * known[0])
