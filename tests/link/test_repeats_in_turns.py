"""Repeats where turns are given by request, and the one that was asked for does not come."""

from math import inf

import pytest

from sdrlinkd.link import Overrides, Qos
from tests.link.lossy import once
from tests.link.standing_turns import StandingTurns, in_turns


@pytest.mark.parametrize(("qos", "comes"), [(Qos.URGENT, True), (Qos.LATENCY, False)])
def test_what_is_urgent_is_announced_in_one_turn_and_repeated_in_the_next(qos, comes):
    air = in_turns(StandingTurns, lost=once(3), share=0.5)
    air.run(1.0)
    air.flow(1, 6, every_s=0.3, overrides=Overrides(qos=qos, lifespan_s=inf))
    air.run(air.now + 0.5)
    assert (3 in air.numbers(2)) == comes
    assert set(air.numbers(2)) >= {0, 1, 2, 4, 5}
    assert max(len(burst.pdus) for _, _, burst in air.bursts) == 1
