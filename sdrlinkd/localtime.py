"""Converts the times of messages, of publication and measurement, to this host's clock."""

import struct
import time
from collections.abc import Callable
from typing import NamedTuple, TypeVar

from sdrlinkd.link import Delivered, Link

STAMP_AT = 4
"""Offset of the time stamp of a std_msgs/Header, after the CDR encapsulation, in octets."""
_LITTLE, _BIG = struct.Struct("<iI"), struct.Struct(">iI")
SECOND_NS = 1_000_000_000
OLDEST_NS = 10 * SECOND_NS
"""Age in ns above which data count as replayed. For this long after the host's clock was set, older
messages are not believed.
"""
TRIES = 4
INTERRUPTED_S = 5e-5
"""Reading three clocks takes less than this, in s, unless something comes in between."""
STEP_NS = SECOND_NS
"""A jump of the clock by more than this, in ns, means that somebody set it."""
SLEPT_NS = SECOND_NS
"""A pause of the event loop in ns after which messages may have waited for it."""
AFTERWARDS_NS = SECOND_NS // 5
"""Time in ns after such a pause in which what had waited is read, if the loop turns."""
TURN_NS, AWAKE_NS = 3 * SECOND_NS // 50, SECOND_NS // 50
"""Longest ordinary turn of the loop in ns; and for how much of a longer one it counts as awake."""


T = TypeVar("T")


class LocalTimes(NamedTuple):
    """Times of a message in ns since 1970, and bounds of their errors in µs; None if unknown."""

    published_ns: int | None = None
    published_error_us: int | None = None
    sampled_ns: int | None = None
    sampled_error_us: int | None = None


UNKNOWN = LocalTimes()


def local_times(
    link: Link, message: Delivered, age_s: float, now: float, now_ns: int, has_header: bool
) -> LocalTimes:
    """The times of a message that is `age_s` old at `now`, which is `now_ns` by the host's clock.

    `has_header`: it begins with a std_msgs/Header.
    """
    known = link.wall_offset(message.src, now)
    if known is None:
        return UNKNOWN
    offset_ns, error_s, wall_error_s = known
    published_ns = now_ns - round(1e9 * age_s)
    published = LocalTimes(published_ns, _us(wall_error_s))
    if not has_header:
        return published
    stamp_ns = header_stamp_ns(message.payload)
    if stamp_ns is None:
        return published
    sampled_ns = stamp_ns + offset_ns
    error_ns = round(1e9 * (error_s + wall_error_s))
    if not -error_ns <= published_ns - sampled_ns <= OLDEST_NS:
        return published
    return published._replace(sampled_ns=sampled_ns, sampled_error_us=_us(error_s))


def header_stamp_ns(cdr: bytes) -> int | None:
    """The stamp of the std_msgs/Header at the start of a CDR message, in ns; None if invalid."""
    if len(cdr) < STAMP_AT + _LITTLE.size:
        return None
    seconds, ns = (_LITTLE if cdr[1] & 1 else _BIG).unpack_from(cdr, STAMP_AT)
    if ns >= SECOND_NS or seconds < 0:
        return None
    return int(seconds) * SECOND_NS + int(ns)


def _us(seconds: float) -> int:
    return max(1, round(1e6 * seconds))


def at_once(link_now: Callable[[], float], host: Callable[[], T]) -> tuple[float, T]:
    """Read the link's clock, and what `host` reads, at one moment.

    If this process was interrupted in between, they are read again: a delay between them would be
    an error of an age. A busy machine may spoil every try; then the last one counts.
    """
    for _ in range(TRIES):
        now, told = link_now(), host()
        if link_now() - now < INTERRUPTED_S:
            break
    return now, told


def host_clocks() -> tuple[int, int]:
    """(the host's time since 1970, a clock of the host that is never set), both in ns.

    The latter also runs while the host sleeps.
    """
    return time.time_ns(), time.clock_gettime_ns(time.CLOCK_BOOTTIME)


class PublishClock:
    """Computes the ages of messages from the publication times that producers report."""

    def __init__(self) -> None:
        self._ahead_ns: int | None = None
        self._set_at_ns = -OLDEST_NS
        self._turned_ns: int | None = None
        self._slept_ns = self._slept_until_ns = 0

    def turned(self, own_ns: int) -> None:
        """Note a turn of the event loop; what waited while the loop slept is that old at most."""
        turn_ns = self._since_turn(own_ns)
        if self._is_reading:
            # A starved loop sleeps again before it has read what waited.
            self._slept_until_ns += _asleep_ns(turn_ns)
            self._slept_ns += _asleep_ns(turn_ns)
        elif turn_ns > SLEPT_NS:
            self._slept_ns, self._slept_until_ns = turn_ns, own_ns + AFTERWARDS_NS
        self._turned_ns = own_ns

    def age(self, published_ns: int | None, now_ns: int, own_ns: int) -> float:
        """Age in s of a message; without publication time, what it may be after a pause."""
        if published_ns is not None:
            return self.age_s(published_ns, now_ns, own_ns)
        turn_ns = self._since_turn(own_ns)
        more_ns = _asleep_ns(turn_ns)
        if self._is_reading and own_ns < self._slept_until_ns + more_ns:
            return 1e-9 * (self._slept_ns + more_ns)
        return 1e-9 * turn_ns if turn_ns > SLEPT_NS else 0.0

    @property
    def _is_reading(self) -> bool:
        """Whether, at the last turn, what had waited was still being read."""
        return self._turned_ns is not None and self._turned_ns < self._slept_until_ns

    def _since_turn(self, own_ns: int) -> int:
        return 0 if self._turned_ns is None else own_ns - self._turned_ns

    def age_s(self, published_ns: int, now_ns: int, own_ns: int) -> float:
        """Age in s of a message; 0 if its time is in the future or unreliable.

        An old time is unreliable if the host's clock was set recently. `now_ns` and `own_ns` are
        the values of `host_clocks`.
        """
        ahead_ns = now_ns - own_ns
        if self._ahead_ns is not None and abs(ahead_ns - self._ahead_ns) > STEP_NS:
            self._set_at_ns = own_ns
        self._ahead_ns = ahead_ns
        age_ns = now_ns - published_ns
        is_unsure = age_ns > OLDEST_NS and own_ns - self._set_at_ns < OLDEST_NS
        return 0.0 if age_ns < 0 or is_unsure else 1e-9 * age_ns


def _asleep_ns(turn_ns: int) -> int:
    return turn_ns - AWAKE_NS if turn_ns > TURN_NS else 0
