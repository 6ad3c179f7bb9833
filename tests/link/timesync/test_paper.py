"""The paper's filter against its equations in fifty digits."""

import pytest

from sdrlinkd.link import PaperFilter
from tests.link.timesync.paper_vectors import CASES, CHECKPOINTS, golden


@pytest.mark.parametrize("case", CASES)
def test_every_state_is_that_of_the_equations(case):
    ours = PaperFilter()
    for index, (stamps, expected) in enumerate(zip(CASES[case], golden(case), strict=True)):
        update = ours.update if len(stamps) == 3 else ours.update_four
        update(*stamps)
        offset_s, skew_s, *counts = expected
        where = f"{case}, sample {index}"
        assert ours.offset_estimated == pytest.approx(1e6 * offset_s, abs=1e-4), where
        assert ours.skew_estimated == pytest.approx(1e6 * skew_s, abs=1e-6), where
        assert [ours.n, ours.high_deviation_count, ours.high_rtt_count, ours.resets] == counts


@pytest.mark.slow
def test_the_vectors_are_those_of_the_literals():
    for case, rows in CHECKPOINTS.items():
        states = list(golden(case))
        for index, offset, skew, *counts in rows:
            assert states[index][:2] == pytest.approx((float(offset), float(skew)), rel=1e-13)
            assert list(states[index][2:]) == counts


def test_a_remote_stamp_means_nothing_until_it_has_converged():
    ours = PaperFilter()
    for i in range(500):
        assert ours.synced(1.0) is None
        ours.update(1e6 * i, 1e6 * i + 500, 1e6 * i + 1000)
    assert ours.synced(1.0) == pytest.approx(1.0)
