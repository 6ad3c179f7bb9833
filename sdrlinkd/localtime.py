"""When messages were published and their data measured, by this host's clock."""

import struct
from collections.abc import Collection
from typing import NamedTuple

from sdrlinkd.link import Delivered, Link

STAMP_AT = 4
"""A std_msgs/Header begins with a time: seconds and nanoseconds, behind the CDR encapsulation."""
_LITTLE, _BIG = struct.Struct("<iI"), struct.Struct(">iI")
SECOND_NS = 1_000_000_000
OLDEST_NS = 10 * SECOND_NS
"""Data that were so old when they were published are replayed; a message that was published so long
before it came was by another clock.
"""


class LocalTimes(NamedTuple):
    """In ns since 1970, with bounds of their errors in µs; None: not known."""

    published_ns: int | None = None
    published_error_us: int | None = None
    sampled_ns: int | None = None
    sampled_error_us: int | None = None


UNKNOWN = LocalTimes()


def local_times(
    link: Link, message: Delivered, age_s: float, now: float, now_ns: int, stamped: Collection[int]
) -> LocalTimes:
    """Of a message that is `age_s` old at `now`, which is `now_ns` by the host's clock.

    Topics in `stamped` begin with a std_msgs/Header.
    """
    known = link.clocks.wall_offset(message.src, now)
    if known is None:
        return UNKNOWN
    offset_ns, error_s, wall_error_s = known
    published_ns = now_ns - round(1e9 * age_s)
    published = LocalTimes(published_ns, _us(wall_error_s))
    if message.topic_id not in stamped:
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
    """The time in the std_msgs/Header that a CDR message begins with; None where there is none."""
    if len(cdr) < STAMP_AT + _LITTLE.size:
        return None
    seconds, ns = (_LITTLE if cdr[1] & 1 else _BIG).unpack_from(cdr, STAMP_AT)
    if ns >= SECOND_NS or seconds < 0:
        return None
    return int(seconds) * SECOND_NS + int(ns)


def _us(seconds: float) -> int:
    return max(1, round(1e6 * seconds))


def age_since(published_ns: int, now_ns: int) -> float:
    """Seconds since a producer published; 0 where that cannot be: a clock was set in between."""
    age_ns = now_ns - published_ns
    return 1e-9 * age_ns if 0 <= age_ns <= OLDEST_NS else 0.0
