"""The CLOCK record, a two-step protocol with true times of sending (wire document, 6.6)."""

import struct
from typing import NamedTuple

from sdrlinkd.wire.repeat import PDU_NUMBER

UNKNOWN_WALL = -(1 << 63)
MAX_WALL_ERROR_US = 0xFFFF
CLOCK_NUMBERS = 1 << 16
"""Count of CLOCK numbers, which wrap around."""
TICK_NS = 10
"""Unit of arrival times in ns."""
_FIXED = struct.Struct(">HHHQqH")
_ARRIVAL = struct.Struct(">BHi")
CLOCK_SIZE, ARRIVAL_SIZE = 2 + _FIXED.size, _ARRIVAL.size
"""Sizes in octets of a CLOCK record without arrivals, and of each arrival."""
MAX_ARRIVALS = (255 - _FIXED.size) // _ARRIVAL.size
_FARTHEST = (1 << 31) - 1


class Arrival(NamedTuple):
    """CLOCK `number` of robot `node` came `after_ns` after the sender's CLOCK `stamped` left."""

    node: int
    number: int
    after_ns: int


class Clock(NamedTuple):
    """A CLOCK record; its times are those of preambles on the sender's own clock.

    It is the sender's CLOCK `number`. The sender's CLOCK `stamped` left at `left_ns`; if none has
    left yet, `stamped` equals `number`. The time since 1970 of the sender's host is its own clock
    plus `wall_ns`, ± `wall_error_us`; UNKNOWN_WALL: unknown. `pdu_number` is that of the PDU with
    the record, None if it is not told.
    """

    boot_id: int
    number: int
    stamped: int
    left_ns: int
    wall_ns: int = UNKNOWN_WALL
    wall_error_us: int = 0
    arrivals: tuple[Arrival, ...] = ()
    pdu_number: int | None = None


def tellable(arrival: Arrival) -> bool:
    """Whether an arrival's time fits into its field."""
    return abs(arrival.after_ns) <= _FARTHEST * TICK_NS


def build_clock(clock: Clock) -> bytes:
    """The value of a CLOCK record. Raises struct.error if a field is out of range."""
    told = [_ARRIVAL.pack(node, n, round(ns / TICK_NS)) for node, n, ns in clock.arrivals]
    if clock.pdu_number is not None:
        told.append(PDU_NUMBER.pack(clock.pdu_number))
    return b"".join((_FIXED.pack(*clock[:6]), *told))


def parse_clock(value: bytes) -> Clock:
    """The fields of a CLOCK value of sufficient length; an incomplete last arrival is ignored."""
    n = (len(value) - _FIXED.size) // _ARRIVAL.size
    told = value[_FIXED.size : _FIXED.size + n * _ARRIVAL.size]
    arrivals = tuple(
        Arrival(node, number, TICK_NS * ticks) for node, number, ticks in _ARRIVAL.iter_unpack(told)
    )
    # Arrivals have seven octets, so four that are left can only be the number.
    rest = value[_FIXED.size + n * _ARRIVAL.size :]
    pdu_number = PDU_NUMBER.unpack(rest)[0] if len(rest) == PDU_NUMBER.size else None
    return Clock._make((*_FIXED.unpack_from(value), arrivals, pdu_number))
