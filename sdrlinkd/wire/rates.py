"""The record RATE: how often consumers want messages of a topic (wire document, section 6.23)."""

import math
from typing import NamedTuple

_OFFSET, _STEPS = 80, 8
MOST_CODE = 255
RATE_OVERHEAD = 1
"""Octets of the value of a RATE record without its topics."""


class RatesAsked(NamedTuple):
    """RATE record: of topics of `node`, the period that suffices consumers at the sender.

    `periods` are (number, code) of a topic each; see `period_s`.
    """

    node: int
    periods: tuple[tuple[int, int], ...]


def period_code(seconds: float) -> int:
    """The code of the longest period that does not exceed `seconds`; the shortest one: about 1 ms.

    Raises ValueError for a period that is not positive and finite.
    """
    if not 0 < seconds < math.inf:
        raise ValueError(f"a period of {seconds} s")
    # Of rounding errors, the nearest code must not lose.
    return min(max(math.floor(_OFFSET + _STEPS * math.log2(seconds) + 1e-9), 0), MOST_CODE)


def period_s(code: int) -> float:
    """The period of a code in s: 1 s for 80, and twice as long for each 8 more."""
    return float(2.0 ** ((code - _OFFSET) / _STEPS))


def build_rates(record: RatesAsked) -> bytes:
    """The value of a RATE record. Raises ValueError if a field does not fit."""
    return bytes((record.node,)) + b"".join(bytes(pair) for pair in record.periods)


def parse_rates(value: bytes) -> RatesAsked:
    """The fields of a RATE value of sufficient length; an odd octet at its end is ignored."""
    pairs = zip(value[1::2], value[2::2], strict=False)
    return RatesAsked(value[0], tuple(pairs))
