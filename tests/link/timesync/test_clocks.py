"""CLOCK records between two robots, honest and not."""

import pytest

from sdrlinkd.link import State, Wall
from sdrlinkd.wire import UNKNOWN_WALL, Arrival, Clock
from tests.link.timesync.pair import Pair


def test_two_robots_learn_each_others_clocks():
    pair = Pair()
    pair.period()
    assert pair.one.state(2, pair.at) is State.UNSYNCED
    pair.run(50, lost=0.3)
    assert abs(pair.error_s()) < 3e-6
    assert pair.one.state(2, pair.at) is State.SYNCED
    assert pair.one.peers[2].estimate(pair.at).skew == pytest.approx(pair.skew, abs=1e-6)
    other = pair.two.peers[1].estimate(pair.there(pair.at))
    assert other.offset_s == pytest.approx(-pair.offset_s, abs=1e-3)
    assert pair.one.state(1, pair.at) is State.SYNCED, "one's own"


def test_who_falls_silent_is_known_less_and_less_well():
    pair = Pair()
    pair.run(100)
    peer = pair.one.peers[2]
    bound_s = peer.estimate(pair.at).bound(pair.at)
    assert peer.state(pair.at + 5.5) is State.HOLDOVER
    assert peer.estimate(pair.at).bound(pair.at + 100) > bound_s
    assert peer.state(pair.at + 1e9) is State.UNSYNCED


def test_a_coarse_clock_is_said_to_be_coarse():
    pair = Pair(delay_s=0.012)
    pair.run(50)
    assert pair.one.state(2, pair.at) is State.COARSE
    assert abs(pair.error_s()) < 1e-4, "delays are equal, but who knows that"


def test_replayed_and_duplicated_clocks_are_counted_and_change_nothing():
    pair = Pair()
    pair.run(50)
    peer = pair.one.peers[2]
    before = (peer.offset.samples, peer.estimate(pair.at))
    for record, _ in pair.sent[:20] + pair.sent[-1:]:
        pair.one.hear(2, record, pair.at + 0.06)
    assert peer.refused == 21
    assert (peer.offset.samples, peer.estimate(pair.at)) == before


def test_another_boot_id_is_believed_when_it_is_said_twice():
    pair = Pair()
    pair.run(50)
    peer, estimate = pair.one.peers[2], pair.one.peers[2].estimate(pair.at)
    stranger = Clock(0xC, 5, 5, 10**9)
    pair.one.hear(2, stranger, pair.at + 0.06)
    assert (peer.refused, peer.resets) == (1, 0)
    assert peer.estimate(pair.at + 0.06) == estimate
    pair.period()
    pair.one.hear(2, stranger._replace(number=6), pair.at + 0.06)
    assert peer.resets == 1
    assert peer.estimate(pair.at + 0.1) is None
    assert pair.one.state(2, pair.at + 0.1) is State.UNSYNCED


def test_stamps_from_the_future_are_not_believed():
    pair = Pair()
    pair.run(50)
    peer = pair.one.peers[2]
    for i in range(20):
        pair.period()
        if i % 10 == 5:
            record, came = pair.sent[-1]
            lie = record._replace(number=(record.number + 1) % 65536, stamped=record.number,
                                  left_ns=record.left_ns + 10**9)  # fmt: skip
            pair.one.hear(2, lie, came + 0.01)
            pair.two.rode()
    assert peer.offset.contradicted == 2
    assert abs(pair.error_s()) < 3e-6


@pytest.mark.parametrize("ppm", [-500, 500])
def test_a_crystal_that_is_far_off_is_followed(ppm):
    pair = Pair(skew=1e-6 * ppm)
    pair.run(100, lost=0.1)
    assert abs(pair.error_s()) < 3e-6
    assert pair.one.peers[2].estimate(pair.at).skew == pytest.approx(1e-6 * ppm, abs=2e-6)


@pytest.mark.slow
def test_a_host_clock_that_is_set_is_followed_at_once_here_and_after_a_minute_there():
    """Who sets another robot's clock by an hour may be somebody else, in its name."""
    pair = Pair()
    pair.one.set_wall(Wall(10**18, 1e-4))
    pair.two.set_wall(Wall(10**18 + 7 * 10**9, 1e-4))
    pair.run(50)
    offset_ns, error_s, _ = pair.one.wall_offset(2, pair.at)
    assert abs(offset_ns - pair.skew * pair.at * 1e9) < 1e4
    assert 2e-4 < error_s < 3e-4
    pair.one.set_wall(Wall(10**18 + 3600 * 10**9, 1e-4))
    assert pair.one.wall_offset(2, pair.at)[0] - offset_ns == 3600 * 10**9
    pair.two.set_wall(Wall(10**18 - 3593 * 10**9, 1e-4))
    pair.period()
    stepped_at = pair.at
    while pair.at < stepped_at + 55:
        assert pair.one.wall_offset(2, pair.at) is None
        assert pair.one.state(2, pair.at) is State.UNSYNCED
        pair.period()
    while pair.at < stepped_at + 65:
        pair.period()
    assert pair.one.state(2, pair.at) is State.SYNCED
    drift_ns = pair.skew * (pair.at - stepped_at) * 1e9
    told = pair.one.wall_offset(2, pair.at)[0] - offset_ns
    assert told == pytest.approx(7.2e12 + drift_ns, rel=1e-9)


def test_without_a_host_clock_nothing_is_said_of_it():
    pair = Pair()
    pair.run(10)
    assert pair.one.wall_offset(2, pair.at) is None
    pair.one.set_wall(Wall(0, 0.0))
    assert pair.one.wall_offset(2, pair.at) is None, "theirs is not known"
    assert pair.one.record(5.0, 10).wall_ns == 0
    assert pair.two.record(5.0, 10).wall_ns == UNKNOWN_WALL
    assert pair.one.wall_offset(9, pair.at) is None, "nobody"


def test_numbers_wrap_and_records_tell_of_so_many_as_there_is_room_for():
    pair = Pair()
    for clocks in (pair.one, pair.two):
        for _ in range(65530):
            clocks.rode()
    pair.run(20)
    assert abs(pair.error_s()) < 3e-6
    for src in range(10, 30):
        pair.one.hear(src, Clock(1, 1, 1, 1), pair.at)
    assert len(pair.one.record(pair.at, 5).arrivals) == 5
    assert len(pair.one.record(pair.at + 40, 30).arrivals) == 0, "nobody was heard for so long"


def test_who_tells_of_many_of_our_clocks_at_once_or_of_old_ones_is_believed_one():
    pair = Pair()
    pair.run(50)
    peer, samples = pair.one.peers[2], pair.one.peers[2].offset.samples
    record, came = pair.sent[-1]
    numbers = (40, 41, 10, 42, 11, 43, 12, 49, 13)
    arrivals = tuple(Arrival(1, number, 10 * number) for number in numbers)
    lie = record._replace(number=record.number + 1, stamped=0, arrivals=arrivals)
    pair.one.hear(2, lie, came + 0.01)
    assert peer.offset.samples == samples
    pair.two.rode()
    pair.run(20)
    assert abs(pair.error_s()) < 3e-6


def test_numbers_that_went_round_while_nobody_listened_are_taken():
    pair = Pair()
    pair.run(20)
    for _ in range(40_000):
        pair.two.rode()
    pair.at += 61.0
    pair.run(20)
    assert pair.one.peers[2].refused == 0
    assert abs(pair.error_s()) < 3e-6


def test_where_there_is_little_room_everybody_is_told_of_in_turn():
    pair = Pair()
    for src in range(10, 20):
        pair.one.hear(src, Clock(1, 1, 1, 1), 10.0)
    told = set()
    for i in range(10):
        record = pair.one.record(10.0 + i, 3)
        assert len(record.arrivals) == 3
        told |= {each.node for each in record.arrivals}
        pair.one.rode()
    assert told == set(range(10, 20))


def test_a_host_clock_not_heard_of_for_long_is_known_less_well():
    pair = Pair()
    pair.one.set_wall(Wall(0, 1e-4))
    pair.two.set_wall(Wall(0, 1e-4))
    pair.run(20)
    errors = [pair.one.wall_offset(2, pair.at + wait_s)[1] for wait_s in (0.2, 60.0)]
    assert errors[1] > errors[0] + 5e-3
