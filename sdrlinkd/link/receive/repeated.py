"""When the PDUs that a source repeats were sent first, as its REPEAT records say."""

from typing import NamedTuple

from sdrlinkd.link.packing import MAX_PDUS
from sdrlinkd.link.receive.duplicates import SequenceTrack
from sdrlinkd.wire import PDU_NUMBERS, REPEAT_UNIT_S, Repeat

LONGEST_HELD_S = 2.0
"""Longest time in s between a PDU and its repetition that is believed."""
SAME_BURST_S = 5e-3
"""Largest difference in s between the times of two PDUs of one burst; a radio tells no difference,
datagrams come one after the other."""
NEAR = 128
"""How far behind the newest one a PDU that comes in a later burst may be."""
LATER_S = 0.5
"""Time in s for which an announcement counts in later bursts."""


def can_be_true(repeat: Repeat) -> bool:
    """Whether a REPEAT names as many PDUs as a burst holds, and no time that is too long."""
    is_recent = repeat.held_100us * REPEAT_UNIT_S <= LONGEST_HELD_S
    return is_recent and 0 < repeat.n_pdus <= MAX_PDUS


class Repeated(NamedTuple):
    """A PDU `number` that was sent first at `first_at`, on our clock, and is repeated."""

    number: int
    first_at: float


class RepeatedPdus:
    """The PDUs that the last REPEAT records of each source announce."""

    def __init__(self) -> None:
        self._by_src: dict[int, tuple[float, dict[int, Repeated]]] = {}

    def __bool__(self) -> bool:
        return bool(self._by_src)

    def clear(self) -> None:
        """Forget all, as the clock starts anew."""
        self._by_src.clear()

    def take(self, repeat: Repeat, src: int, track: SequenceTrack, at: float) -> bool:
        """Take a REPEAT of robot `src` in a burst that came at `at`; False if it is nonsense.

        Only what a robot says of its own PDUs counts.
        """
        node, number, held, n_pdus = repeat
        if node != src:
            return True
        if not can_be_true(repeat):
            track.distrust()
            return False
        burst_at, told = self._by_src.get(node, (at, {}))
        if abs(at - burst_at) > SAME_BURST_S:
            told = {}
        first_at = at - held * REPEAT_UNIT_S
        for i in range(n_pdus):
            each = (number + i) % PDU_NUMBERS
            told[each & 0xFF] = Repeated(each, first_at)
        self._by_src[node] = at, told
        return True

    def find(self, src: int, seq: int, at: float, track: SequenceTrack) -> Repeated | None:
        """What was announced of a PDU in the burst that came at `at`; None if it is a new one.

        A later burst may bring what is missing, too, unless a new PDU may have its sequence number.
        """
        burst_at, told = self._by_src.get(src, (at, {}))
        if not 0 <= at - burst_at <= LATER_S:
            del self._by_src[src]
            return None
        found = told.get(seq)
        if found is None or at - burst_at <= SAME_BURST_S:
            return found
        is_near = (track.newest - found.number) % PDU_NUMBERS < NEAR
        return found if is_near and track.lacks(found.number) else None
