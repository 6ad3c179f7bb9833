"""The numbers of our sealed PDUs: each (T, seq) once, whatever happens to clocks and power."""

from math import floor as whole
from math import inf

from sdrlinkd.wire import N_SEQS, N_TICKS, TICKS_PER_S

RESERVE_S = 60.0
"""Key time in s that is on disk ahead of use."""
LEAST_RESERVE_S = 20.0
"""Reserve in s at which the floor is moved on."""
LEAP_S = 30.0
"""Key time in s that a start skips. It is longer than a proof lasts, so that no attacker can pass a
PDU of one life off as one of another by delaying it (see `peers`)."""
MOST_BROUGHT = N_TICKS // 2
"""T from which on another key begins with its own numbers."""
REMEMBERED_TICKS = 10 * TICKS_PER_S


class Numbers:
    """Gives out the numbers (T, seq), and says which floor must be on disk.

    `floor` is what was on disk; 0: the key is new; None: that is lost, and there are no numbers
    before `resume`. No T may be used before `move_floor` tells a floor above it that is on disk.
    """

    def __init__(self, floor: int | None) -> None:
        self.is_lost = floor is None
        """Whether it is not known which numbers were used before."""
        begin = _leap(floor) if floor else 0
        self._begin = begin
        self._zero: float | None = None
        self.floor = begin
        """T from which on nothing is on disk."""
        self.newest = begin
        """The largest T given out, or the first that may be."""
        self._last = [-1] * N_SEQS
        """The last T given out with each seq."""
        self._used: dict[int, bytearray] = {}
        """The numbers given out lately: a 1 for each seq, by T."""
        self._end = begin
        """The first T that must not be given out."""
        self._then, self._ticks_then = -inf, 0
        self.first = begin
        """The first T of this life."""

    def clock(self, at: float) -> float:
        """The key time in s at time `at`."""
        if self._zero is None:
            self._zero = at
        return self._begin / TICKS_PER_S + (at - self._zero)

    @property
    def has_begun(self) -> bool:
        """Whether the key time of this life runs."""
        return self._zero is not None

    def offset(self, at: float) -> float:
        """The key time minus the link's clock at time `at`, in s; it changes with the key alone."""
        return self.clock(at) - at

    def begin_anew(self) -> None:
        """Go on from the newest T, as another clock starts."""
        if self._zero is not None:
            self._begin, self._zero, self._then = self.newest + 1, None, -inf

    def change_key(self, floor: int | None) -> None:
        """Seal with another key from now on, of which `floor` is on disk, as at the start.

        T goes on, so that others notice nothing, as long as it is below MOST_BROUGHT.
        No number is given out before `move_floor`.
        """
        was_lost, self.is_lost = self.is_lost, floor is None
        if floor is None:
            return
        if was_lost or floor > self.newest or self.newest >= MOST_BROUGHT:
            self._begin_at(_leap(floor) if floor else 0)
        self._then = -inf
        self.floor = self._end = self.newest

    def resume(self, floor: int) -> None:
        """Go on above `floor`, as the numbers were lost; none is given out before `move_floor`."""
        self.is_lost = False
        self._begin_at(_leap(floor))
        self.floor = self._end = self.newest

    def is_out(self, at: float) -> bool:
        """Whether no number that is on disk is left at `at`."""
        return not self.is_lost and self._ticks(at) >= self.floor

    def is_used_up(self, at: float) -> bool:
        """Whether the key is used up at `at`."""
        return not self.is_lost and self._ticks(at) >= N_TICKS

    def wanted_floor(self, at: float) -> int | None:
        """The floor that should be written to disk now; None: the present one suffices."""
        if self.is_lost:
            return None
        # Before the first burst, no time has begun.
        ticks = self.newest if self._zero is None else max(self._ticks(at), self.newest)
        if self.floor - ticks > LEAST_RESERVE_S * TICKS_PER_S or self.floor >= N_TICKS:
            return None
        return min(ticks + round(RESERVE_S * TICKS_PER_S), N_TICKS)

    def move_floor(self, written: int) -> None:
        """Note the floor that is on disk now."""
        self.floor = max(self.floor, written)
        self._end = min(self.floor, N_TICKS)

    def fits(self, at: float, seq: int, n: int) -> bool:
        """Whether `n` PDUs from `seq` on can have numbers in a burst at `at`."""
        ticks, last = self._ticks(at), self._last
        if self.is_lost or not self.first <= ticks < self._end:
            return False
        return all(last[(seq + i) % N_SEQS] < ticks for i in range(n))

    def take(self, at: float, seq: int) -> int | None:
        """The T of a PDU with `seq` in a burst at `at`; None: it must wait."""
        # The PDUs of a burst have one start.
        ticks = self._ticks_then if at == self._then else self._ticks(at)
        if self.is_lost or self._last[seq] >= ticks or not self.first <= ticks < self._end:
            return None
        self._last[seq] = ticks
        used = self._used.get(ticks)
        if used is not None:
            used[seq] = 1
            return ticks
        self._then, self._ticks_then = at, ticks
        self.newest = max(self.newest, ticks)
        self._used[ticks] = used = bytearray(N_SEQS)
        used[seq] = 1
        while (oldest := next(iter(self._used))) < ticks - REMEMBERED_TICKS:
            del self._used[oldest]
        return ticks

    def is_foreign(self, ticks: int, seq: int) -> bool:
        """Whether a number under our id, newer than our start, was not given out by us.

        False if it is too old to know.
        """
        if self.is_lost or ticks < max(self.first, self.newest - REMEMBERED_TICKS):
            return False
        used = self._used.get(ticks)
        return used is None or not used[seq]

    def _begin_at(self, ticks: int) -> None:
        self._begin = self.first = self.newest = ticks
        self._zero, self._then = None, -inf
        self._used.clear()
        self._last = [-1] * N_SEQS

    def _ticks(self, at: float) -> int:
        # Never ahead of the key time: that no PDU seems younger than it is depends on this.
        return whole(self.clock(at) * TICKS_PER_S)


def _leap(floor: int) -> int:
    return min(floor + round(LEAP_S * TICKS_PER_S), N_TICKS)
