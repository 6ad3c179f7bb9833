"""Figures of `benchmarks.team`, which are exact on every machine."""

import pytest

from benchmarks.team.healing import heal
from tests.laws import trials


@pytest.mark.slow
@pytest.mark.parametrize("to_all", [False, True])
def test_a_route_heals_in_time_and_nothing_is_lost(to_all):
    for seed in range(101, 101 + trials(3)):
        found = heal(seed, to_all=to_all)
        assert found.back_s < 0.4
        assert found.lost == 0
        assert found.control_share < 0.02
