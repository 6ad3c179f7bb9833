"""The maximum length of bursts on slow or busy machines."""

from random import Random

import pytest

from sdrlinkd.modem.testing import OVERHEAD_S, Tempo


@pytest.mark.parametrize("per_sample_s", [5e-9, 2e-8, 1e-6])
@pytest.mark.parametrize("held_up", [0.0, 0.2])
@pytest.mark.parametrize("seed", range(3))
def test_the_machine_is_learned_and_who_holds_it_up_now_and_then_is_not(
    per_sample_s, held_up, seed
):
    rng, tempo = Random(seed), Tempo()
    for _ in range(600):
        n = rng.randrange(5000, 100_000)
        seconds = n * per_sample_s * rng.uniform(1, 1.3)
        tempo.note(n, seconds + (0.02 if rng.random() < held_up else 0.0))
    n = tempo.samples_in(OVERHEAD_S + 0.01)
    assert 0.7 < n * per_sample_s / 0.01 < 1.15, f"seed {seed}"


@pytest.mark.parametrize("slower", [1 / 50, 3, 50])
def test_a_machine_that_was_busy_or_idle_for_an_hour_is_known_again(slower):
    tempo = Tempo()
    for _ in range(40_000):
        tempo.note(10_000, slower * 1e-3)
    n, limit = 0, 250
    while not 0.7e-3 < tempo.seconds(10_000) < 1.5e-3 and n < limit:
        tempo.note(10_000, 1e-3)
        n += 1
    assert n < limit


def test_where_there_is_no_time_there_are_no_samples():
    assert Tempo().samples_in(OVERHEAD_S / 2) == 0
