"""Makes this robot's CLOCK records, and tracks the clocks of all others."""

from collections import OrderedDict
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from sdrlinkd.link.timesync.envelope import DualEnvelope
from sdrlinkd.link.timesync.estimate import Estimate
from sdrlinkd.link.timesync.paper_clock import PaperClock
from sdrlinkd.link.timesync.peer import Offset, PeerClock, State, Wall
from sdrlinkd.reports import ClockReport
from sdrlinkd.wire import (
    CLOCK_NUMBERS,
    MAX_ARRIVALS,
    MAX_WALL_ERROR_US,
    UNKNOWN_WALL,
    Clock,
    tellable,
)

REMEMBERED = 64
RIDES_FROM = 0.75
"""Share of a period after the last CLOCK from which the next one may use spare room."""
HOST_DRIFT = 1e-4
"""Largest drift of a host's clock against its radio's since the last CLOCK, in s per s."""
FORGOTTEN_S = 30.0
"""Time in s without a CLOCK after which a robot is left out of our CLOCK records."""


class ClockParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How robots learn each other's clocks."""

    period_s: Annotated[float, Meta(ge=0, le=10)] = 0.2
    """Time between CLOCK records in s, if there is room for them; 0: no CLOCK records."""
    filter: Literal["envelope", "paper"] = "envelope"
    """Filter that estimates the clock offset from burst times; paper: that of the Sensors 2023
    paper."""
    share: Annotated[float, Meta(gt=0, le=0.5)] = 0.02
    """Share of airtime for PDUs that hold only CLOCK and RECEIPT records, all robots together."""


class Clocks:
    """Our own CLOCK records and when they left, and a PeerClock for each robot heard."""

    def __init__(self, params: ClockParams, boot_id: int, own_id: int) -> None:
        self._period_s = params.period_s
        self._filter = params.filter
        self._boot_id = boot_id
        self._own_id = own_id
        self._number = 0
        self._left: OrderedDict[int, float] = OrderedDict()
        self.due_at = 0.0 if params.period_s else float("inf")
        self.peers: dict[int, PeerClock] = {}
        self._wall: Wall | None = None
        """Clock of our own host."""
        self._resolution_s = 2e-5
        """Resolution of burst times, in s."""

    def set_resolution(self, resolution_s: float) -> None:
        """Set the resolution of burst times in s, for clocks that become known from now on."""
        self._resolution_s = resolution_s

    def set_wall(self, wall: Wall) -> None:
        """Set the offset of our host's clock from our link's, to be announced to others."""
        self._wall = wall

    def end(self) -> None:
        """Send no more CLOCK records."""
        self.due_at = float("inf")

    def record(self, start: float, room: int, *, is_numbered: bool = False) -> Clock:
        """The next CLOCK record, for a burst at `start`, with arrivals of at most `room` robots.

        `is_numbered`: it has a place for the number of its PDU.
        """
        self.due_at = start + RIDES_FROM * self._period_s
        stamped, left_s = self._number, start
        if self._left:
            stamped, left_s = next(reversed(self._left.items()))
        left_ns = max(0, round(1e9 * left_s))
        wall_ns, error_us = UNKNOWN_WALL, 0
        if self._wall is not None:
            wall_ns = self._wall.ns
            error_us = min(round(1e6 * self._wall.error_s), MAX_WALL_ERROR_US)
        told = [
            peer.arrival(1e-9 * left_ns)
            for peer in self.peers.values()
            if start - peer.last_at < FORGOTTEN_S
        ]
        arrivals = [each for each in told if each is not None and tellable(each)]
        # The PDU number takes the place of one more.
        most = min(max(room, 0), MAX_ARRIVALS - 1)
        if len(arrivals) > most:
            # Rotate, so that each robot gets the arrivals of its own CLOCKs.
            first = self._number * most % len(arrivals)
            arrivals = arrivals[first:] + arrivals[:first]
        return Clock(
            self._boot_id, self._number, stamped, left_ns, wall_ns, error_us,
            tuple(arrivals[:most]), 0 if is_numbered else None,
        )  # fmt: skip

    def rode(self) -> int:
        """Note that the record was put into a burst; returns its number."""
        number, self._number = self._number, (self._number + 1) % CLOCK_NUMBERS
        return number

    def left(self, number: int, at: float) -> None:
        """Note that the burst with CLOCK `number` left at `at`."""
        self._left[number] = at
        self._left.move_to_end(number)
        if len(self._left) > REMEMBERED:
            self._left.popitem(last=False)

    def hear(self, src: int, clock: Clock, at: float) -> None:
        """Take a CLOCK record of robot `src` that came at `at`."""
        peer = self.peers.get(src)
        if peer is None:
            peer = self.peers[src] = PeerClock(src, self._new_offset())
        peer.hear(clock, at, self._own_id, self._left)

    def report(self, src: int, now: float) -> ClockReport | None:
        """What is known about a robot's clock; None if nothing is, or if it is our own."""
        peer = self.peers.get(src)
        if peer is None:
            return None
        wall = self.wall_offset(src, now)
        report = peer.report(now)
        if wall is None:
            return report
        return msgspec.structs.replace(
            report, wall_offset_ms=1e-6 * wall[0], wall_bound_us=1e6 * wall[1]
        )

    def estimate(self, src: int, now: float) -> Estimate | None:
        """Our link's clock minus that of robot `src`; None if unknown."""
        peer = self.peers.get(src)
        return None if peer is None else peer.estimate(now)

    def _new_offset(self) -> Offset:
        return PaperClock() if self._filter == "paper" else DualEnvelope(self._resolution_s)

    def wall_offset(self, src: int, now: float) -> tuple[int, float, float] | None:
        """Our host's time since 1970 minus that of robot `src`; None if unknown.

        (difference in ns, bound of its error in s, part of that bound due to the two hosts' clocks)
        """
        if self._wall is None:
            return None
        if src == self._own_id:
            return 0, self._wall.error_s, self._wall.error_s
        peer = self.peers.get(src)
        if peer is None or peer.wall is None or peer.state(now) is State.UNSYNCED:
            return None
        known = peer.estimate(now)
        if known is None:
            return None
        hosts_s = self._wall.error_s + peer.wall.error_s + HOST_DRIFT * max(0.0, now - peer.last_at)
        offset_ns = self._wall.ns - peer.wall.ns + round(1e9 * known.offset(now))
        return offset_ns, known.bound(now) + hosts_s, hosts_s

    def has_contact(self, src: int, now: float) -> bool:
        """Whether a robot hears our CLOCKs, and we hear its; always true without CLOCKs."""
        return not self._period_s or self.state(src, now) is not State.UNSYNCED

    def state(self, src: int, now: float) -> State:
        """How well a robot's clock is known; our own always is."""
        if src == self._own_id:
            return State.SYNCED
        peer = self.peers.get(src)
        return State.UNSYNCED if peer is None else peer.state(now)
