"""The records WANT and GRANT: who needs the air, and who gets it (wire document, 6.18, 6.19)."""

import struct
from math import ceil, log2
from typing import NamedTuple

from sdrlinkd.wire.registry import BROADCAST

AGE_UNIT_S, AIR_UNIT_S = 1e-3, 5e-5
"""The times that the codes 1 of an age and of an airtime stand for, in s."""
STEPS = 8
"""Codes of times for each doubling."""
MAX_AGE, MAX_AIR = 127, 255
FAR = 255
"""The reach of a robot that does not know how far the others are."""
ANYBODY = BROADCAST
"""In a GRANT: any robot that has no turn."""
LAST_PLAN = ((0, 0),)
"""The turns of a GRANT after which there are no rounds any more."""
_WANT = struct.Struct(">BI")
WANT_SIZE = 2 + _WANT.size
"""Octets of a WANT record."""
_GRANT = struct.Struct(">BBI")
GRANT_OVERHEAD = 2 + _GRANT.size
"""Octets of a GRANT record without turns."""
TURN_SIZE = 2
"""Octets of a GRANT record for each turn."""


class Want(NamedTuple):
    """WANT record: what robot `node` would send next.

    Its most urgent message has class `qos` (0 to 3), `priority` (0 to 127) and an age. `air` is the
    airtime that the class needs, and `lower_air` that of all lower classes. Times are codes; see
    `time_of`.
    """

    node: int
    qos: int
    priority: int
    age: int
    air: int
    lower_air: int

    @property
    def age_s(self) -> float:
        """Age of the message in s, as far as it was counted."""
        return time_of(self.age, AGE_UNIT_S)

    @property
    def air_s(self) -> float:
        """Airtime in s that the class needs."""
        return time_of(self.air, AIR_UNIT_S)

    @property
    def lower_air_s(self) -> float:
        """Airtime in s that all lower classes need."""
        return time_of(self.lower_air, AIR_UNIT_S)


class Grant(NamedTuple):
    """GRANT record: turns of round `number`, planned by a robot with everybody within `reach` hops.

    The first turn begins `begins_us` µs after the time from which the FRAME before it counts its
    phase. `turns` has (robot, length in ticks) in order; a turn of 0 ticks goes back in time, by as
    many ticks as its robot says. Robot ANYBODY stands for those without a turn.
    """

    number: int
    reach: int
    begins_us: int
    turns: tuple[tuple[int, int], ...] = ()


def code_of(time_s: float, unit_s: float, most: int) -> int:
    """The code of a time in s, rounded up so that nothing needs more than was told; 0: no time."""
    if time_s <= 0:
        return 0
    return min(1 + ceil(STEPS * log2(max(1.0, time_s / unit_s)) - 1e-9), most)


def time_of(code: int, unit_s: float) -> float:
    """The time in s that a code stands for."""
    return unit_s * 2 ** ((code - 1) / STEPS) if code else 0.0


def build_want(want: Want) -> bytes:
    """The value of a WANT record. Raises ValueError or struct.error if a field is out of range."""
    node, qos, priority, age, air, lower_air = want
    for value, bits in ((qos, 2), (priority, 7), (age, 7), (air, 8), (lower_air, 8)):
        if not 0 <= value < 1 << bits:
            raise ValueError(f"{want} does not fit its record")
    return _WANT.pack(node, qos << 30 | priority << 23 | age << 16 | air << 8 | lower_air)


def parse_want(value: bytes) -> Want:
    """The fields of a WANT value of sufficient length."""
    node, bits = _WANT.unpack_from(value)
    return Want(
        node, bits >> 30, bits >> 23 & 0x7F, bits >> 16 & 0x7F, bits >> 8 & 0xFF, bits & 0xFF
    )


def build_grant(grant: Grant) -> bytes:
    """The value of a GRANT record. Raises ValueError or struct.error if a field does not fit."""
    return _GRANT.pack(*grant[:3]) + b"".join(bytes(turn) for turn in grant.turns)


def parse_grant(value: bytes) -> Grant:
    """The fields of a GRANT value of sufficient length; an octet after the last turn is ignored."""
    rest = iter(value[_GRANT.size :])
    number, reach, begins_us = _GRANT.unpack_from(value)
    return Grant(number, reach, begins_us, tuple(zip(rest, rest, strict=False)))
