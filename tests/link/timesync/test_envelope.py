"""The dual envelope: its bound holds for any delays, and it follows clocks that jump."""

import math
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.link import DualEnvelope
from sdrlinkd.link.timesync import STEP_S, Side
from tests.laws import law

SEED = 11
RESOLUTION_S = 2e-5


def exchange(envelope, at, offset_s, there_s, back_s):
    """Own − other's clock is `offset_s`; one burst each way, with these delays."""
    envelope.was_heard(at, at + there_s - offset_s, 0.0)
    envelope.heard(at + there_s - offset_s, at + there_s + back_s, 0.0)


delays = st.one_of(st.just(0.0), st.floats(0, 0.03), st.floats(0, 5e-5))


@law(60)
@given(
    st.floats(-1e4, 1e4),
    st.floats(-1e-3, 1e-3),
    st.lists(st.tuples(st.floats(0.001, 3.0), delays, delays), min_size=1, max_size=60),
)
def test_the_error_is_within_the_bound_whatever_the_delays(offset_s, skew, steps):
    envelope = DualEnvelope(RESOLUTION_S)
    at = 0.0
    for wait_s, there_s, back_s in steps:
        at += wait_s
        envelope.was_heard(at, at + there_s - (offset_s + skew * at), 0.0)
        came = at + there_s + back_s
        envelope.heard(came - back_s - (offset_s + skew * (came - back_s)), came, 0.0)
        estimate = envelope.solve(came)
        if estimate is None:
            continue
        truth_s = offset_s + skew * came
        # The other side's clock was read one delay before ours.
        slack_s = 1e-3 * 0.06
        assert abs(estimate.offset(came) - truth_s) <= estimate.bound(came) + slack_s
        later = came + 10.0
        assert estimate.bound(later) >= estimate.bound(came)


def noisy(rng, longest_s=0.02):
    return 0.0 if rng.random() < 0.4 else rng.uniform(0, longest_s)


@pytest.mark.parametrize("step_s", [0.003, -0.003, 0.05, -0.2, 3600.0])
def test_a_clock_that_jumps_is_followed_within_five_seconds(step_s):
    rng = Random(SEED)
    envelope = DualEnvelope(RESOLUTION_S)
    for i in range(300):
        at = i / 5
        offset_s = 1.0 + 2e-5 * at + (step_s if at >= 40 else 0.0)
        exchange(envelope, at, offset_s, noisy(rng), noisy(rng))
        envelope.solve(at + 0.1)
        error_s = envelope.estimate.offset(at) - offset_s if envelope.estimate else math.inf
        if 5 < at < 40 or at > 45:
            assert abs(error_s) < 1e-3, f"{at} s, seed {SEED}"
    assert envelope.steps == 1


@pytest.mark.slow
def test_single_bad_stamps_are_counted_and_change_nothing():
    rng = Random(SEED)
    good, bad = DualEnvelope(RESOLUTION_S), DualEnvelope(RESOLUTION_S)
    n_bad = 0
    for i in range(300):
        at, there_s, back_s = i / 5, noisy(rng), noisy(rng)
        for envelope in (good, bad):
            exchange(envelope, at, 1.0, there_s, back_s)
        if i > 50 and rng.random() < 0.02:
            n_bad += 1
            bad.heard(at - 1.0 + 0.04, at, 0.0)
        for envelope in (good, bad):
            envelope.solve(at + 0.1)
    assert n_bad > 2
    assert (bad.contradicted, bad.steps, good.contradicted) == (n_bad, 0, 0)
    assert bad.estimate == good.estimate


def test_stamps_from_the_future_before_anything_is_known_are_dropped_in_time():
    rng = Random(SEED)
    envelope = DualEnvelope(RESOLUTION_S)
    envelope.heard(105.0, 0.05, 0.0)
    for i in range(20):
        at = 0.1 + i / 5
        exchange(envelope, at, 1.0, noisy(rng), noisy(rng))
        envelope.solve(at + 0.1)
    assert envelope.narrowed
    assert abs(envelope.estimate.offset(4.0) - 1.0) < 1e-3


def test_delays_shorter_than_the_airtime_cannot_be():
    envelope = DualEnvelope(RESOLUTION_S)
    for i in range(40):
        at, offset_s = i / 5, 1.0 if i < 20 else 1.0008
        envelope.was_heard(at, at + 0.002 - offset_s, 0.002)
        envelope.heard(at + 0.002 - offset_s, at + 0.004, 0.002)
        envelope.solve(at + 0.1)
    assert abs(envelope.estimate.offset(8.0) - 1.0008) < 5e-5


def test_one_direction_alone_says_nothing():
    envelope = DualEnvelope()
    for i in range(10):
        envelope.heard(i / 5, i / 5 + 0.001, 0.0)
        assert envelope.solve(i / 5) is None


def test_what_is_kept_is_bounded_and_no_older_than_the_window():
    side = Side(5.0)
    for i in range(20_000):
        side.add(i * 0.003, 1.0 + (i % 7) * 1e-3, 0.0)
    assert len(side) <= 52
    assert side.x[0] >= 20_000 * 0.003 - 5.2
    n, mean_x, mean_v = side.totals()
    assert n == pytest.approx(5.0 / 0.003, rel=0.05)
    assert mean_v == pytest.approx(1.003, abs=1e-4)
    assert mean_x == pytest.approx(57.5, abs=0.2)


@law()
@given(st.lists(st.one_of(st.floats(0, 20), st.none()), max_size=40))
def test_times_stay_sorted_whatever_comes(times):
    side = Side(5.0)
    for x in times:
        if x is None:
            side.clear()
        else:
            side.add(x, -x, 0.0)
        assert (side.x[1:] > side.x[:-1]).all()


def test_what_came_before_does_not_count_once_all_is_forgotten():
    side = Side(5.0)
    side.add(3.0, 1.0, 0.0)
    side.add(1.0, 0.0, 0.0)
    assert (side.x.tolist(), side.v.tolist(), side.totals()[0]) == ([3.0], [1.0], 1.0)
    side.clear()
    side.add(1.0, 0.0, 0.0)
    assert side.x.tolist() == [1.0]


@law()
@given(st.lists(st.tuples(st.floats(0.11, 3), st.floats(0, 1)), min_size=1, max_size=40),
       st.floats(-0.01, 0.01))  # fmt: skip
def test_only_points_on_which_a_line_can_rest_are_looked_at(steps, slope):
    side, x = Side(1000.0), 0.0
    for wait_s, v in steps:
        x += wait_s
        side.add(x, v, 0.0)
    xs, vs = side.lowest(0.01)
    assert (vs - slope * xs).min() == (side.v - slope * side.x).min()


@pytest.mark.slow
@pytest.mark.parametrize("hz", [20, 50, 200])
@pytest.mark.parametrize("seed", range(20))
def test_samples_close_together_are_as_good_as_others(hz, seed):
    rng = Random(seed)
    envelope = DualEnvelope(1e-6)
    for i in range(2 * hz):
        at = i / hz
        exchange(envelope, at, 1.0 + 3e-5 * at, rng.expovariate(1e3), rng.expovariate(1e3))
        estimate = envelope.solve(at + 0.01)
        truth_s = 1.0 + 3e-5 * at
        assert abs(estimate.offset(at) - truth_s) <= estimate.bound(at) + 1e-5
    assert abs(estimate.offset(at) - truth_s) < 5e-4, f"seed {seed}"


def test_samples_in_any_order_end():
    envelope = DualEnvelope(1e-6)
    for number in (40, 41, 42, 10, 43, 44, 11, 45, 12, 46, 13):
        envelope.was_heard(number * 0.15, number * 0.15 - 5.0, 0.0)
        envelope.heard(number * 0.15 + 9.0, number * 0.15, 0.0)
    assert envelope.solve(7.0) is None


def settled(offset_s=1.0):
    """An envelope that knows an offset from 10 s of exchanges, each with a delay of 10 µs."""
    envelope = DualEnvelope(RESOLUTION_S)
    for i in range(50):
        exchange(envelope, i / 5, offset_s, 1e-5, 1e-5)
        envelope.solve(i / 5)
    return envelope


def heard(envelope, at, offset_s, delay_s=1e-5):
    envelope.heard(at - delay_s - offset_s, at, 0.0)


def was_heard(envelope, at, offset_s, delay_s=1e-5):
    envelope.was_heard(at, at + delay_s - offset_s, 0.0)


@pytest.mark.parametrize("step_s", [-0.002, -2e-4])
def test_two_early_records_and_four_late_ones_the_other_way_show_that_a_clock_moved(step_s):
    """Long waits between the two early records, so that the rule of three of eight says nothing."""
    envelope = settled()
    after_s = 1.0 + step_s
    heard(envelope, 10.0, after_s)
    for i in range(8):
        heard(envelope, 10.1 + i / 5, after_s, 0.02)
    heard(envelope, 12.0, after_s)
    for i in range(3):
        was_heard(envelope, 12.1 + i / 5, after_s)
    assert (envelope.contradicted, envelope.steps, envelope.narrowed) == (2, 0, 0)
    was_heard(envelope, 13.0, after_s)
    is_step = abs(step_s) > STEP_S
    assert (envelope.contradicted, envelope.steps, envelope.narrowed) == (0, is_step, not is_step)
    assert abs(envelope.solve(13.0).offset_s - after_s) < 5e-5


def test_two_early_records_are_bad_if_one_the_other_way_is_not_late():
    envelope = settled()
    heard(envelope, 10.0, 0.998)
    heard(envelope, 12.0, 0.998)
    for i in range(6):
        was_heard(envelope, 12.1 + i / 5, 1.0, 1e-5 if i == 2 else 0.02)
    assert (envelope.contradicted, envelope.steps, envelope.narrowed) == (2, 0, 0)
    assert abs(envelope.solve(13.5).offset_s - 1.0) < 5e-5


def test_a_step_that_turns_out_false_is_undone_and_counted():
    """Three early stamps while nothing comes the other way."""
    envelope = settled()
    before = envelope.estimate
    for i in range(3):
        heard(envelope, 10.0 + i / 5, 0.995)
    assert (envelope.steps, envelope.false_steps) == (1, 0)
    was_heard(envelope, 10.6, 1.0)
    assert envelope.solve(10.6) is None, "no line fits what came since"
    heard(envelope, 10.7, 1.0)
    was_heard(envelope, 10.8, 1.0)
    assert (envelope.steps, envelope.false_steps, envelope.contradicted) == (0, 1, 3)
    assert envelope.estimate == before
    estimate = envelope.solve(10.8)
    assert abs(estimate.offset_s - 1.0) < 1e-5
    assert estimate.bound_s < 5e-5


def test_a_step_is_true_once_more_records_confirm_it():
    envelope = settled()
    bounds_s = []
    for i in range(30):
        exchange(envelope, 10.0 + i / 5, 0.995, 1e-5, 1e-5)
        estimate = envelope.solve(10.0 + i / 5)
        bounds_s.append(estimate.bound_s)
        if i > 3:
            assert abs(estimate.offset_s - 0.995) < 2e-5
    assert bounds_s[4] > 0.005, "it may still be false"
    assert bounds_s[-1] < 1e-4
    assert (envelope.steps, envelope.false_steps, envelope.contradicted) == (1, 0, 0)


def test_the_bound_covers_a_small_contradiction_until_it_is_refuted():
    envelope = settled()
    bound_s = envelope.estimate.bound_s
    heard(envelope, 10.0, 0.9997)
    doubted_s = envelope.solve(10.0).bound_s
    assert bound_s + 5e-4 < doubted_s < bound_s + 6e-4, "twice as much as it is early"
    was_heard(envelope, 10.1, 1.0)
    assert envelope.solve(10.1).bound_s == pytest.approx(bound_s, rel=0.1)
