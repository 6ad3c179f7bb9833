"""Clocks whose frequency moves: the bound holds, and grows no more than it must."""

import math
from random import Random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.timesync.filters import Ours
from benchmarks.timesync.moving import MOTIONS, moving
from benchmarks.timesync.runs import follow
from sdrlinkd.link import DualEnvelope
from sdrlinkd.link.timesync import WINDOW_S, Wander
from tests.laws import law, one_in

SEED = 5
HELD_PCT = 99.9
LENGTHS_S = {
    "ramp_1ppm_a_min": 200.0,
    "ramp_10ppm_in_60s": 200.0,
    "warm_up_20ppm": 200.0,
    "sine_3ppm_2min": 200.0,
    "rate_jump_2ppm": 200.0,
    "rate_jump_20ppm": 200.0,
    "rate_jump_200ppm": 200.0,
    "slew_500ppm_20s": 200.0,
    "leap_0.4ms": 200.0,
    "early_1pct": 200.0,
    "hours_4ppm_a_day": 600.0,
    "by_sample_wander": 60.0,
    "by_sample_1ppm_a_min": 60.0,
}


def course(name, seed=SEED):
    motion = MOTIONS[name]
    ours = Ours(motion.resolution_s)
    return follow(ours, moving(name, seed, at_most_s=LENGTHS_S[name])), ours.envelope


def held_pct(found, name):
    good, n = found.held(*MOTIONS[name].jumps_at)
    assert n > 250
    return 100 * good / n


@pytest.mark.slow
@pytest.mark.parametrize("name", one_in(4, sorted(LENGTHS_S.keys() - {"rate_jump_20ppm"})))
def test_the_bound_holds_while_the_frequency_moves(name):
    found, _ = course(name)
    assert held_pct(found, name) >= HELD_PCT, f"seed {SEED}"
    assert np.nanmedian(found.bound_s) < (3e-6 if MOTIONS[name].by_sample else 1e-4)


@pytest.mark.slow
def test_the_bound_holds_10_s_after_a_jump_that_takes_so_long_to_be_seen():
    """20 µs a second, where a delay of 50 µs is usual."""
    found, _ = course("rate_jump_20ppm")
    counts = (found.at < 119.5) | (found.at > 130.0)
    assert (np.abs(found.error_s[counts]) <= found.bound_s[counts])[10:].all(), f"seed {SEED}"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["by_sample_wander", "by_sample_1ppm_a_min"])
def test_without_wander_it_would_not(name, monkeypatch):
    monkeypatch.setattr(Wander, "allowed", lambda *_: 0.0)
    found, _ = course(name)
    assert held_pct(found, name) < HELD_PCT


@pytest.mark.slow
def test_a_rate_that_jumps_is_known_again_with_fewer_samples():
    found, envelope = course("rate_jump_200ppm")
    assert envelope.narrowed + envelope.steps > 0
    after = (found.at > 130.0) & (found.at < 160.0)
    assert np.abs(found.error_s[after]).max() < 1e-4


@pytest.mark.slow
def test_the_bound_of_a_steady_clock_is_little_more_than_its_stamps_resolution():
    rng = Random(SEED)
    envelope = DualEnvelope(2e-5)
    for i in range(300):
        at = i / 5
        envelope.was_heard(at, at - 1.0 + rng.expovariate(2e4), 0.0)
        envelope.heard(at - 1.0, at + rng.expovariate(2e4), 0.0)
        envelope.solve(at)
    assert 2e-5 < envelope.estimate.bound_s < 4e-5


@pytest.mark.slow
def test_stamps_that_are_worse_than_their_resolution_widen_the_bound_and_drop_nothing():
    rng = Random(SEED)
    envelope = DualEnvelope(2e-5)
    held = 0
    for i in range(600):
        at = i / 5
        envelope.was_heard(at, at - 1.0 + rng.gauss(1e-4, 6e-5), 0.0)
        envelope.heard(at - 1.0, at + rng.gauss(1e-4, 6e-5), 0.0)
        estimate = envelope.solve(at)
        held += estimate is not None and abs(estimate.offset_s - 1.0) <= estimate.bound_s
    assert held > 590
    assert envelope.narrowed == 0


def test_what_was_learned_of_wander_fades_and_never_falls_below_what_is_assumed():
    wander, assumed = Wander(2e-7, WINDOW_S), 2e-6 / 60
    assert wander.allowed(0.0) == pytest.approx(assumed)
    assert wander.learned(0.0) == 0.0
    wander.learn(wander.steps(10.0)[-1], 10.0)
    assert wander.learned(10.0) == pytest.approx(8 * assumed)
    assert wander.steps(10.0) == [], "faster is a jump"
    assert wander.learned(70.0) == pytest.approx(4 * assumed)
    assert wander.allowed(70.0) == pytest.approx(9 * assumed)
    assert wander.allowed(3600.0) == pytest.approx(assumed)
    assert wander.learned(3600.0) == 0.0
    assert Wander(2e-5, WINDOW_S).allowed(0.0) > 2 * assumed, "less cannot be seen"


delays = st.one_of(st.just(0.0), st.floats(0, 0.03), st.floats(0, 5e-5))


@law(60)
@given(
    st.floats(-1e3, 1e3),
    st.floats(-5e-4, 5e-4),
    st.sampled_from([2e-5, 1e-6, 2e-7]),
    st.lists(
        st.tuples(st.floats(0.02, 5.0), delays, delays, st.floats(-1, 1)), min_size=1, max_size=60
    ),
)
def test_the_bound_covers_the_truth_for_all_delays_and_all_wander_that_is_assumed(
    offset_s, skew, resolution_s, steps
):
    envelope = DualEnvelope(resolution_s)
    most = Wander(resolution_s, WINDOW_S).allowed(0.0)
    at = 0.0
    for wait_s, there_s, back_s, share in steps:
        # The rate moves between exchanges only.
        offset_s += skew * wait_s + 0.5 * share * most * wait_s**2
        skew += share * most * wait_s
        at += wait_s
        envelope.was_heard(at, at - offset_s + there_s, 0.0)
        envelope.heard(at - offset_s - back_s, at, 0.0)
        estimate = envelope.solve(at)
        assert estimate is not None
        assert math.isfinite(estimate.bound_s)
        assert math.isfinite(estimate.skew_bound)
        assert 0 <= estimate.bound(at - 1.0) <= estimate.bound(at) <= estimate.bound(at + 1.0)
        assert abs(estimate.offset(at) - offset_s) <= estimate.bound(at)
        later_s = offset_s + skew * 7.0 + 0.5 * share * most * 7.0**2
        assert abs(estimate.offset(at + 7.0) - later_s) <= estimate.bound(at + 7.0)
    assert (envelope.steps, envelope.contradicted) == (0, 0)


@law(60)
@given(
    st.lists(
        st.tuples(st.floats(0.0, 3.0), st.floats(-0.1, 0.1), st.floats(-0.1, 0.1)),
        min_size=1, max_size=60,
    )
)  # fmt: skip
def test_the_bound_is_a_number_whatever_the_stamps(steps):
    envelope = DualEnvelope(2e-5)
    at = 0.0
    for wait_s, there_s, back_s in steps:
        at += wait_s
        envelope.was_heard(at, at + there_s, 0.0)
        envelope.heard(at - back_s, at, 0.0)
        estimate = envelope.solve(at)
        assert estimate is None or 0 <= estimate.bound(at) < math.inf
        assert envelope.false_steps >= 0
        assert envelope.steps >= 0
        assert envelope.contradicted >= 0
