"""The CLOCK record: two steps, so that the time of sending is the true one (section 6.6)."""

import struct
from typing import NamedTuple

UNKNOWN_WALL = -(1 << 63)
MAX_WALL_ERROR_US = 0xFFFF
CLOCK_NUMBERS = 1 << 16
"""Numbers of CLOCKs, which go round."""
TICK_NS = 10
"""Unit in ns in which arrivals are told."""
_FIXED = struct.Struct(">HHHQqH")
_ARRIVAL = struct.Struct(">BHi")
CLOCK_SIZE, ARRIVAL_SIZE = 2 + _FIXED.size, _ARRIVAL.size
"""Octets of a record without arrivals, and of each arrival."""
MAX_ARRIVALS = (255 - _FIXED.size) // _ARRIVAL.size
_FARTHEST = (1 << 31) - 1


class Arrival(NamedTuple):
    """CLOCK `number` of `node` came `after_ns` after the sender's own CLOCK `stamped` had left."""

    node: int
    number: int
    after_ns: int


class Clock(NamedTuple):
    """A CLOCK record: times by the sender's own clock, at preambles.

    This is its CLOCK `number`; its CLOCK `stamped` left at `left_ns` (none has left yet: the number
    is its own). Its host's time since 1970 is `wall_ns` more than its own clock, plus or minus
    `wall_error_us`; UNKNOWN_WALL: not known.
    """

    boot_id: int
    number: int
    stamped: int
    left_ns: int
    wall_ns: int = UNKNOWN_WALL
    wall_error_us: int = 0
    arrivals: tuple[Arrival, ...] = ()


def tellable(arrival: Arrival) -> bool:
    """Whether an arrival is near enough in time for its field."""
    return abs(arrival.after_ns) <= _FARTHEST * TICK_NS


def build_clock(clock: Clock) -> bytes:
    """The value of a CLOCK record. Raises struct.error when a field is out of range."""
    told = [_ARRIVAL.pack(node, n, round(ns / TICK_NS)) for node, n, ns in clock.arrivals]
    return b"".join((_FIXED.pack(*clock[:-1]), *told))


def parse_clock(value: bytes) -> Clock:
    """The fields of a CLOCK value of sufficient length; a cut arrival at its end is ignored."""
    n = (len(value) - _FIXED.size) // _ARRIVAL.size
    told = value[_FIXED.size : _FIXED.size + n * _ARRIVAL.size]
    arrivals = tuple(
        Arrival(node, number, TICK_NS * ticks) for node, number, ticks in _ARRIVAL.iter_unpack(told)
    )
    return Clock._make((*_FIXED.unpack_from(value), arrivals))
