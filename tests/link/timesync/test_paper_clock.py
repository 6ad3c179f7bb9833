"""The Sensors paper's filter in place of ours: `clock.filter = "paper"`."""

import pytest

from sdrlinkd.link import State
from tests.link.timesync.pair import Pair

CONVERGES = 500
"""Round trips that the paper's filter needs to converge (Equation 6)."""


@pytest.mark.parametrize("lost", [0.0, 0.2])
def test_it_knows_nothing_for_500_round_trips_and_then_the_clock_within_its_bound(lost):
    pair = Pair(filter="paper")
    pair.run(CONVERGES - 20, lost)
    assert pair.one.state(2, pair.at) is State.UNSYNCED
    assert pair.one.report(2, pair.at).bound_us is None
    pair.run(round(CONVERGES / (1 - lost) ** 2), lost)
    report = pair.one.report(2, pair.at)
    assert report.state == "synced"
    assert report.samples >= CONVERGES
    # As printed, it lags a drifting clock; half of the longest round trip bounds the delay effects.
    assert abs(pair.error_s()) < 1e-3


def test_a_clock_that_was_set_is_taken_for_bad_samples_until_the_filter_begins_anew():
    pair = Pair(filter="paper", skew=0.0)
    pair.run(CONVERGES + 20)
    assert abs(pair.error_s()) < 1e-5
    pair.offset_s += 3.0
    pair.run(5)
    assert pair.one.report(2, pair.at).contradicted >= 4
    pair.run(3)
    report = pair.one.report(2, pair.at)
    assert (report.state, report.steps) == ("unsynced", 1)
    pair.run(CONVERGES + 20)
    assert abs(pair.error_s()) < 1e-5


def test_another_boot_forgets_what_was_known():
    pair = Pair(filter="paper")
    pair.run(CONVERGES + 20)
    pair.two = Pair(filter="paper", seed=9, boot_id=0xC).two
    pair.run(3)
    assert pair.one.state(2, pair.at) is State.UNSYNCED
    assert pair.one.report(2, pair.at).resets == 1
