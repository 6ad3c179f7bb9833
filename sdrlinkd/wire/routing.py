"""The records LSA and ROUTE, about links and who forwards (wire document, 6.15 and 6.16)."""

import struct
from collections.abc import Mapping
from math import log2
from typing import NamedTuple

from sdrlinkd.wire.crc import crc16
from sdrlinkd.wire.registry import BROADCAST
from sdrlinkd.wire.repeat import PDU_NUMBERS

LSA_NUMBERS = 1 << 16
"""Count of LSA numbers, which wrap around."""
LOSS_UNIT = 1 / 16
"""Unit of the loss in an LSA, in −log₂ of the share of PDUs that arrive."""
MAX_LOSS = 255
_LSA = struct.Struct(">BH")
LSA_OVERHEAD = 2 + _LSA.size
"""Octets of an LSA record that lists no robot."""
HEARD_SIZE = 2
"""Octets of an LSA record for each robot."""
_ROUTE = struct.Struct(">BBI")
ROUTE_OVERHEAD = 2 + _ROUTE.size
"""Octets of a ROUTE record that names no robot."""


class Lsa(NamedTuple):
    """LSA record `number` of robot `node`: the loss of what it hears directly, by robot.

    Losses are −log₂ of the share of PDUs that arrive, in units of LOSS_UNIT.
    """

    node: int
    number: int
    losses: tuple[tuple[int, int], ...] = ()

    def is_newer(self, number: int) -> bool:
        """Whether it is newer than the LSA with this number."""
        return 0 < (self.number - number) % LSA_NUMBERS < LSA_NUMBERS // 2


class Route(NamedTuple):
    """ROUTE record: who forwards PDUs of `src` to `dst`, from PDU `number` on.

    That is for PDUs that the sender of the record has sent, as their source or as a relay.
    """

    src: int
    dst: int
    number: int
    robots: bytes


def loss_of(share: float) -> int:
    """The loss, in units of LOSS_UNIT, of a link over which this share of the PDUs arrives."""
    return MAX_LOSS if share <= 0 else min(round(-log2(share) / LOSS_UNIT), MAX_LOSS)


def share_of(loss: int) -> float:
    """The share of the PDUs that arrive over a link with this loss."""
    return 2 ** (-LOSS_UNIT * loss)


def lsa_digest(numbers: Mapping[int, int]) -> Lsa:
    """The LSA record that stands for all LSAs held: `numbers` has theirs by robot."""
    octets = b"".join(_LSA.pack(node, number) for node, number in sorted(numbers.items()))
    return Lsa(BROADCAST, crc16(octets))


def heard_number(known: int, told: int) -> int:
    """A told PDU number, in the count that has reached `known`."""
    return known + (told - known + PDU_NUMBERS // 2) % PDU_NUMBERS - PDU_NUMBERS // 2


def build_lsa(lsa: Lsa) -> bytes:
    """The value of an LSA record. Raises ValueError or struct.error if a field is out of range."""
    return _LSA.pack(*lsa[:2]) + b"".join(bytes(each) for each in lsa.losses)


def parse_lsa(value: bytes) -> Lsa:
    """The fields of an LSA value of sufficient length."""
    node, number = _LSA.unpack_from(value)
    return Lsa(node, number, _pairs(value[_LSA.size :]))


def build_route(route: Route) -> bytes:
    """The value of a ROUTE record. Raises struct.error if a field is out of range."""
    return _ROUTE.pack(*route[:3]) + route.robots


def parse_route(value: bytes) -> Route:
    """The fields of a ROUTE value of sufficient length."""
    return Route._make((*_ROUTE.unpack_from(value), bytes(value[_ROUTE.size :])))


def _pairs(octets: bytes) -> tuple[tuple[int, int], ...]:
    return tuple(zip(octets[::2], octets[1::2], strict=False))
