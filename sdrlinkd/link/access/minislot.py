"""`minislot`: once the channel falls idle, each node may start only in its own mini-slot.

All robots that hear the channel fall idle count from the same moment, so with one mini-slot each,
no two start at once. A mini-slot must be long enough to hear another robot start and to hold back.
The order rotates with the last sender; otherwise the first robot of the list would have the channel
to itself. A robot knows this order if it could read the header of the last burst. Robots that could
not read it come after all that could, in the order of the list. The only state is what kept the
channel busy last (FIRST), and the current round since then.
"""

from collections.abc import Mapping, Sequence
from enum import Enum, auto

from sdrlinkd.link.access.base import NEVER, BusyChannel, Slot, Wish
from sdrlinkd.link.access.own_slots import OwnSlots
from sdrlinkd.link.qos import Qos
from sdrlinkd.link.traits import Sensed

LEVELS = 2
"""Levels of mini-slots: urgent and latency start before default and bulk."""
SECTIONS = LEVELS + 1
"""Sections of a round: the levels, then the robots that do not know the last sender."""


class Ended(Enum):
    """What kept the channel busy last, as far as this robot knows."""

    OWN = auto()
    """Our own burst."""
    FORWARDED = auto()
    """Our burst with another robot's PDUs."""
    READ = auto()
    """A burst that we could read, from its source."""
    RELAYED = auto()
    """A burst that we could read, from a relay; receivers do not know which relay."""
    UNREAD = auto()
    """A burst that we could not read, or one of a robot that is not listed."""


FIRST: Mapping[Ended, int] = {
    Ended.OWN: 1,
    Ended.FORWARDED: 0,
    Ended.READ: 1,
    Ended.RELAYED: 0,
}
"""By what kept the channel busy: how many places after the source of its PDUs the first robot of
the next round is. For other events the order is unknown."""


class MiniSlots(BusyChannel):
    """Mini-slot access, without collisions among nodes that hear each other, urgent classes first.

    Mini-slot 0 starts `minislot_s` after the channel falls idle. The mini-slots of the higher level
    come first, one per node, then those of the lower level. Within a level, the node whose PDUs
    were sent last comes last, or first if a relay has sent them. After the last mini-slot a new
    round starts. Mini-slots grow with the time of silence, because clocks drift. A node starts only
    when it has heard the mini-slot before its own pass unused.
    """

    others_follow = True

    def __init__(
        self, own_id: int, nodes: Sequence[int], minislot_s: float, detect_s: float
    ) -> None:
        super().__init__()
        self._nodes = list(nodes)
        self._rank = self._nodes.index(own_id)
        self.pause_s = self.minislot_s = minislot_s
        self.round_s = SECTIONS * len(nodes) * minislot_s
        self._detect_s = detect_s
        self._last = (-1, NEVER, False)
        """The last PDU heard, as (source, start of its burst, whether it was relayed)."""
        self._own_src: int | None = None
        """Source of the PDUs that we sent last, if we relayed them."""
        self._slots = OwnSlots(minislot_s, SECTIONS * len(nodes))
        self._is_last = False
        """Whether our next mini-slot comes after those of all others."""

    @property
    def state(self) -> str:
        """Policy, robots and times, for people."""
        text = (
            f"minislot: {len(self._nodes)} robots, {self.minislot_s * 1e3:.3g} ms each, round in "
            f"{self.round_s * 1e3:.3g} ms"
        )
        return f"{text}; last of all, as the last burst was not read" if self._is_last else text

    @property
    def lacks(self) -> str:  # type: ignore[override]
        """A burst that tells the order, if the last one could not be read."""
        return "a burst that it can read" if self._is_last else ""

    def mean_wait_s(self, qos: Qos) -> float:
        """Mean wait in s: all mini-slots of the higher level, and half of those of our level."""
        n = len(self._nodes)
        return self.minislot_s * (1 + (n - 1) / 2 + (n if qos > Qos.LATENCY else 0))

    @property
    def turn_s(self) -> float:
        """Time in s from an idle channel to the first mini-slot of the lower level."""
        return self.minislot_s * (1 + len(self._nodes))

    def carries(self, burst_s: float) -> float:
        """Share of airtime of bursts that start once the mini-slots of the higher level passed."""
        return burst_s / (burst_s + self.turn_s)

    def slot(self, wish: Wish) -> Slot | None:
        """Our next mini-slot, once all mini-slots before it were sensed idle."""
        earliest, qos, sensed = wish.earliest, wish.qos, wish.sensed
        idle_since = self.idle_since(sensed)
        if idle_since is None:
            return None
        place = self._place(idle_since, qos, sensed)
        own = self._slots.next(place, idle_since, earliest)
        if not own.is_known(sensed.until, self._detect_s):
            return None
        # A burst in an urgent mini-slot carries only urgent classes after its first PDU.
        least = Qos.LATENCY if qos <= Qos.LATENCY else Qos.BULK
        return Slot.exact(max(own.start, earliest), least=least)

    def sent(self, end: float, src: int | None) -> None:
        """Remember our own burst, which we do not hear."""
        super().sent(end, src)
        self._own_src = src

    def heard(self, src: int, at: float, is_relayed: bool, *, is_weak: bool = False) -> None:
        """Remember the last sender, which determines the order within a level."""
        self._last = (src, at, is_relayed)

    def _place(self, idle_since: float, qos: Qos, sensed: Sensed) -> int:
        """Index of our mini-slot in the round after the last event on the channel."""
        n = len(self._nodes)
        level = 0 if qos <= Qos.LATENCY else 1
        ended, src = self._what_ended(idle_since, sensed)
        self._is_last = ended not in FIRST
        if ended not in FIRST:
            return LEVELS * n + self._rank
        first = self._nodes.index(src) + FIRST[ended]
        return level * n + (self._rank - first) % n

    def _what_ended(self, idle_since: float, sensed: Sensed) -> tuple[Ended, int]:
        """(what kept the channel busy until `idle_since`, source of its PDUs)."""
        src, at, is_relayed = self._last
        if idle_since == self.own_end:
            ended, src = Ended.OWN, self._nodes[self._rank]
            if self._own_src is not None:
                ended, src = Ended.FORWARDED, self._own_src
        elif sensed.burst_at != at:
            ended = Ended.UNREAD
        else:
            ended = Ended.RELAYED if is_relayed else Ended.READ
        return (ended, src) if src in self._nodes else (Ended.UNREAD, src)
