"""Bursts are shorter where the channel changes fast; what was learned of it is forgotten."""

from math import inf, sqrt

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.link import Outcome, Overrides, Qos, RateParams, Told
from sdrlinkd.link.transmit.testing import STALE_S, WEIGHT, Motion, longest_burst_s
from sdrlinkd.wire import BROADCAST, Beacon, PduBuilder, build_records
from tests.link.radios import LOCKSTEP, params
from tests.link.world import PDU_S, make_link, neighbors, next_burst

SIZE, FILE = 64, Told("etc/sdrlinkd.toml", ())


@given(st.lists(st.floats(0, 1000), min_size=1))
def test_it_is_between_the_least_and_the_most_that_was_heard(found_hz):
    motion = Motion()
    for i, doppler_hz in enumerate(found_hz):
        motion.note(2, doppler_hz, 0.1 * i)
    now = 0.1 * len(found_hz)
    assert min(found_hz) - 1e-6 <= motion.doppler_hz(2, now) <= max(found_hz) + 1e-6
    assert motion.longest_s({2}, now) == longest_burst_s(motion.doppler_hz(2, now))


def test_who_stands_still_again_is_believed_to():
    motion = Motion()
    motion.note(2, 100.0, 0.0)
    for i in range(40):
        motion.note(2, 0.0, 0.1 * i)
    assert motion.doppler_hz(2, 4.0) == pytest.approx(100 * sqrt((1 - WEIGHT) ** 40))


def test_what_was_not_heard_for_long_is_forgotten():
    motion = Motion()
    motion.note(2, 100.0, 0.0)
    assert motion.longest_s({2}, STALE_S) == pytest.approx(0.002)
    assert motion.longest_s({2}, STALE_S + 0.1) == inf
    motion.note(2, 0.0, STALE_S + 0.2)
    assert motion.doppler_hz(2, STALE_S + 0.2) == 0.0


def test_a_burst_to_all_is_as_short_as_the_fastest_needs():
    motion = Motion()
    motion.note(2, 40.0, 0.0)
    motion.note(3, 100.0, 0.0)
    motion.note(4, 0.0, 0.0)
    longest = [motion.longest_s({dst}, 1.0) for dst in (2, 3, 4, 5, BROADCAST)]
    assert longest == [pytest.approx(0.005), pytest.approx(0.002), inf, inf, pytest.approx(0.002)]


def told(src, number):
    builder = PduBuilder(SIZE)
    builder.add_record(build_records([Beacon(src, 0)]))
    return builder.build(0, src, BROADCAST, number, 1)


@pytest.mark.parametrize(("doppler_hz", "n_pdus"), [(None, 8), (0.0, 8), (40.0, 5), (1000.0, 1)])
def test_bursts_are_bounded_by_the_doppler_that_was_heard(doppler_hz, n_pdus):
    link = make_link(pdu_size=SIZE, greedy=False)
    link.attach(
        LOCKSTEP._replace(longest_burst_s=(8 * PDU_S,)), params("none", [1, 2]), RateParams()
    )
    link.hear(told(2, 0), 1.0, 20.0, doppler_hz=doppler_hz)
    for i in range(20):
        link.submit(0, bytes([i]) * 40, 1.0, Overrides(qos=Qos.BULK))
    burst = next_burst(link, 1.0)
    assert len(burst.pdus) == n_pdus
    link.confirm(burst, Outcome.SENT, 1.0)
    (report,) = neighbors(link).values()
    assert report.doppler_hz == doppler_hz
    bounds = doppler_hz is not None and doppler_hz > 25
    assert (report.longest_burst_s is not None) == bounds
    words = [line for line in link.why(0, FILE, 1.0) if "on the move" in line]
    assert len(words) == bounds
