"""This robot's CLOCK records, and the clocks of all others."""

from collections import OrderedDict
from typing import Annotated

import msgspec
from msgspec import Meta

from sdrlinkd.link.timesync.peer import PeerClock, State, Wall
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
"""Of a period after the last one, a record is ready for spare room."""
HOST_DRIFT = 1e-4
"""Of a host's clock against its radio's, which it has told of at its last CLOCK."""
FORGOTTEN_S = 30.0
"""A robot not heard for so long is not told of any more."""


class ClockParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How robots learn each other's clocks."""

    period_s: Annotated[float, Meta(ge=0, le=10)] = 0.2
    """Between CLOCK records, where there is room for them; 0: none."""
    share: Annotated[float, Meta(gt=0, le=0.5)] = 0.02
    """Of all airtime, for PDUs with nothing but CLOCK and RECEIPT records, all robots together."""


class Clocks:
    """Numbers of own CLOCKs, when they left, and a PeerClock for each robot heard."""

    def __init__(self, params: ClockParams, boot_id: int, own_id: int) -> None:
        self._period_s = params.period_s
        self._boot_id = boot_id
        self._own_id = own_id
        self._number = 0
        self._left: OrderedDict[int, float] = OrderedDict()
        self.due_at = 0.0 if params.period_s else float("inf")
        self.peers: dict[int, PeerClock] = {}
        self.wall: Wall | None = None
        """Of our own host."""
        self.resolution_s = 2e-5
        """How exact times of bursts are."""

    def end(self) -> None:
        """No more."""
        self.due_at = float("inf")

    def record(self, start: float, room: int) -> Clock:
        """The next one, at `start`; it tells of at most `room` robots."""
        self.due_at = start + RIDES_FROM * self._period_s
        stamped, left_s = self._number, start
        if self._left:
            stamped, left_s = next(reversed(self._left.items()))
        left_ns = max(0, round(1e9 * left_s))
        wall_ns, error_us = UNKNOWN_WALL, 0
        if self.wall is not None:
            wall_ns = self.wall.ns
            error_us = min(round(1e6 * self.wall.error_s), MAX_WALL_ERROR_US)
        told = [
            peer.arrival(1e-9 * left_ns)
            for peer in self.peers.values()
            if start - peer.last_at < FORGOTTEN_S
        ]
        arrivals = [each for each in told if each is not None and tellable(each)]
        most = min(max(room, 0), MAX_ARRIVALS)
        if len(arrivals) > most:
            # In turn, so that everybody hears of himself.
            first = self._number * most % len(arrivals)
            arrivals = arrivals[first:] + arrivals[:first]
        return Clock(
            self._boot_id, self._number, stamped, left_ns, wall_ns, error_us, tuple(arrivals[:most])
        )

    def rode(self) -> int:
        """The record went into a burst; its number."""
        number, self._number = self._number, (self._number + 1) % CLOCK_NUMBERS
        return number

    def left(self, number: int, at: float) -> None:
        """The burst with CLOCK `number` left at `at`."""
        self._left[number] = at
        self._left.move_to_end(number)
        if len(self._left) > REMEMBERED:
            self._left.popitem(last=False)

    def hear(self, src: int, clock: Clock, at: float) -> None:
        """Another robot's."""
        peer = self.peers.get(src)
        if peer is None:
            peer = self.peers[src] = PeerClock(src, self.resolution_s)
        peer.hear(clock, at, self._own_id, self._left)

    def wall_offset(self, src: int, now: float) -> tuple[int, float, float] | None:
        """Our host's time since 1970 less that of robot `src`.

        (difference in ns, bound of its error in s, of that what the two hosts' clocks have to
        answer for); None: not known.
        """
        if self.wall is None:
            return None
        if src == self._own_id:
            return 0, self.wall.error_s, self.wall.error_s
        peer = self.peers.get(src)
        if peer is None or peer.wall is None or peer.state(now) is State.UNSYNCED:
            return None
        known = peer.estimate(now)
        if known is None:
            return None
        hosts_s = self.wall.error_s + peer.wall.error_s + HOST_DRIFT * max(0.0, now - peer.last_at)
        offset_ns = self.wall.ns - peer.wall.ns + round(1e9 * known.offset(now))
        return offset_ns, known.bound(now) + hosts_s, hosts_s

    def state(self, src: int, now: float) -> State:
        """How well a robot's clock is known; our own is."""
        if src == self._own_id:
            return State.SYNCED
        peer = self.peers.get(src)
        return State.UNSYNCED if peer is None else peer.state(now)
