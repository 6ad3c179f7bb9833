"""`minislot`: once the channel falls idle, each node may begin only in a mini-slot of its own.

All who hear the channel fall idle count from the same moment, so one mini-slot a robot is enough
for no two to begin at once; it must be as long as it takes to hear another begin and to hold back.
The order turns with who sent last, or the first robot of the list would have the air for itself.
That order is known to who read the last burst's header. Who did not comes after all who did, in the
order of the list. What kept the channel busy is all the state there is (FIRST), besides the round
that we are in since.
"""

from collections.abc import Mapping, Sequence
from enum import Enum, auto

from sdrlinkd.link.access.base import NEVER, BusyChannel, Slot, Wish
from sdrlinkd.link.qos import Qos
from sdrlinkd.link.traits import Sensed

LEVELS = 2
"""Urgent and latency begin before default and bulk."""
SECTIONS = LEVELS + 1
"""Last come those who could not read who sent last, and so do not know the order."""
DRIFT = 4e-5
"""Two clocks of 20 ppm part by that much a second since they heard the channel fall idle."""


class Ended(Enum):
    """What kept the channel busy last, as far as a robot can tell."""

    OWN = auto()
    """Our own burst."""
    FORWARDED = auto()
    """Our burst, with PDUs of another."""
    READ = auto()
    """A burst that we read, from its source."""
    RELAYED = auto()
    """A burst that we read, from a relay: nobody else knows from which."""
    UNREAD = auto()
    """Energy alone, or a robot that is not listed."""


FIRST: Mapping[Ended, int] = {
    Ended.OWN: 1,
    Ended.FORWARDED: 0,
    Ended.READ: 1,
    Ended.RELAYED: 0,
}
"""So many places after the source of its PDUs is the robot that comes first then. After what is
not here, the order is not known."""


class MiniSlots(BusyChannel):
    """Collision-free among nodes that hear each other, and the more urgent class first.

    Mini-slot 0 begins `minislot_s` after the channel falls idle. First come those of the higher
    level, one a node, then those of the lower; in a level, the one whose PDUs were sent last comes
    last, or, when a relay has sent them, first. When all are passed they begin anew, a little wider
    the longer it is quiet: clocks part. A node begins only when it has heard the one before its own
    pass.
    """

    others_follow = True

    def __init__(
        self, own_id: int, nodes: Sequence[int], minislot_s: float, detect_s: float
    ) -> None:
        super().__init__()
        self._nodes = list(nodes)
        self._rank = self._nodes.index(own_id)
        self.pause_s = self._minislot_s = minislot_s
        self.round_s = SECTIONS * len(nodes) * minislot_s
        self._detect_s = detect_s
        self._last = (-1, NEVER, False)
        """(source, when its burst began, whether it was relayed) of the last PDU."""
        self._own_src: int | None = None
        """Whose PDUs we sent last, if we forwarded them."""
        self._n_slots = SECTIONS * len(nodes)
        self._round = (NEVER, 0.0)
        """(since when the channel is idle, when it began after that) of the round we are in."""

    @property
    def state(self) -> str:
        """Policy, robots and times, for people."""
        return (
            f"minislot: {len(self._nodes)} robots, {self._minislot_s * 1e3:.3g} ms each, round in "
            f"{self.round_s * 1e3:.3g} ms"
        )

    def mean_wait_s(self, qos: Qos) -> float:
        """Half the robots of a level come before, and all of the higher one."""
        n = len(self._nodes)
        return self._minislot_s * (1 + (n - 1) / 2 + (n if qos > Qos.LATENCY else 0))

    @property
    def turn_s(self) -> float:
        """From when the channel falls idle to the first of the lower level, in s."""
        return self._minislot_s * (1 + len(self._nodes))

    def carries(self, burst_s: float) -> float:
        """Whoever is next in order begins when all of the higher level were passed."""
        return burst_s / (burst_s + self.turn_s)

    def slot(self, wish: Wish) -> Slot | None:
        """Our next mini-slot, once all before it were heard to be idle."""
        earliest, qos, _, sensed = wish
        idle_since = self.idle_since(sensed)
        if idle_since is None:
            return None
        place = self._place(idle_since, qos, sensed)
        begin = self._round[1] if self._round[0] == idle_since else self._minislot_s
        while True:
            drift_s = DRIFT * begin
            width_s = self._minislot_s + 2 * drift_s
            start = idle_since + begin + place * width_s
            if start >= earliest - 1e-9:
                break
            begin += self._n_slots * width_s
        self._round = (idle_since, begin)
        if start > sensed.until + width_s - drift_s - self._detect_s:
            return None
        # Who came first because it was urgent does not keep the air for what is not.
        least = Qos.LATENCY if qos <= Qos.LATENCY else Qos.BULK
        return Slot.exact(max(start, earliest), least=least)

    def sent(self, end: float, src: int | None) -> None:
        """What we send ourselves, we do not hear."""
        super().sent(end, src)
        self._own_src = src

    def heard(self, src: int, at: float, is_relayed: bool) -> None:
        """The order in a level follows from who sent last."""
        self._last = (src, at, is_relayed)

    def _place(self, idle_since: float, qos: Qos, sensed: Sensed) -> int:
        """Number of our mini-slot after what kept the channel busy."""
        n = len(self._nodes)
        level = 0 if qos <= Qos.LATENCY else 1
        ended, src = self._what_ended(idle_since, sensed)
        if ended not in FIRST:
            return LEVELS * n + self._rank
        first = self._nodes.index(src) + FIRST[ended]
        return level * n + (self._rank - first) % n

    def _what_ended(self, idle_since: float, sensed: Sensed) -> tuple[Ended, int]:
        """(what kept the channel busy up to then, the source of its PDUs)."""
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
