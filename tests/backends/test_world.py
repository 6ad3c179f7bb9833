"""Where nodes are, and how well they hear each other there."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from backends import AirParams, LinkOverride, Outage, Track, World
from tests.laws import law

SPEED_OF_LIGHT = 299_792_458.0
AIR = AirParams(snr_db=17.0, snr_db_at_1m=60.0, path_loss_exponent=2.0)
metres = st.floats(-1e5, 1e5)


def placed(*places, air=AIR, **more):
    """A world whose nodes 0, 1, … stay at these places."""
    tracks = {i: Track([(0.0, x, y)]) for i, (x, y) in enumerate(places)}
    return World(air, tracks, **more)


def between(outages):
    """Returns a function: whether two nodes hear each other at a time, with these outages."""
    world = World(AIR, {}, outages=[Outage(*each) for each in outages])
    return lambda t: world.hop(1, 2, t) is not None


@law()
@given(
    st.lists(
        st.tuples(st.integers(-50, 50), metres, metres),
        min_size=1,
        max_size=6,
        unique_by=lambda each: each[0],
    ).map(sorted),
    st.floats(-60, 60),
)
def test_a_track_is_straight_between_waypoints_and_stays_beyond_them(waypoints, t):
    t_s, x, y = np.array(waypoints, float).T
    wanted = np.interp(t, t_s, x), np.interp(t, t_s, y)
    assert Track(waypoints).at(t) == pytest.approx(wanted, abs=1e-6)


def test_a_node_is_at_its_waypoints_at_their_times():
    waypoints = [(1.0, 0.0, 5.0), (3.0, 10.0, -5.0), (4.0, 10.0, 0.0)]
    track = Track(waypoints)
    assert [track.at(t) for t, _, _ in waypoints] == [(x, y) for _, x, y in waypoints]
    assert track.at(2.0) == (5.0, 0.0)


def test_one_waypoint_is_a_place():
    track = Track([(7.0, 3.0, -4.0)])
    assert {track.at(t) for t in (-1.0, 0.0, 7.0, 1e9)} == {(3.0, -4.0)}


def test_two_waypoints_at_one_time_are_a_jump():
    track = Track([(0.0, 0.0, 0.0), (1.0, 10.0, 0.0), (1.0, 90.0, 0.0), (2.0, 80.0, 0.0)])
    assert track.at(0.5) == (5.0, 0.0)
    assert track.at(1.0) == (90.0, 0.0)
    assert track.at(1.5) == (85.0, 0.0)


@pytest.mark.parametrize(
    ("exponent", "distance_m", "snr_db"),
    [(2.0, 10.0, 40.0), (2.0, 1000.0, 0.0), (3.5, 100.0, -10.0), (0.0, 1e5, 60.0), (4.0, 1.0, 60)],
)
def test_snr_falls_with_distance_by_the_exponent(exponent, distance_m, snr_db):
    air = AirParams(snr_db=17.0, snr_db_at_1m=60.0, path_loss_exponent=exponent)
    world = placed((5.0, 2.0), (5.0, 2.0 - distance_m), air=air)
    assert world.hop(0, 1, 0.0).snr_db == pytest.approx(snr_db, abs=1e-9)


@law()
@given(metres, metres, st.floats(0, 8))
def test_places_work_both_ways_and_light_takes_its_time(x, y, exponent):
    air = AirParams(snr_db_at_1m=300.0, path_loss_exponent=exponent)
    world = placed((x, y), (-y, 3 * x), air=air)
    one, other = world.hop(0, 1, 0.0), world.hop(1, 0, 0.0)
    assert one == other
    distance_m = np.hypot(x + y, y - 3 * x)
    assert one.delay_s == pytest.approx(distance_m / SPEED_OF_LIGHT, rel=1e-9, abs=1e-18)
    assert one.doppler_ppm == 0


def test_nearer_than_a_metre_is_a_metre():
    world = placed((0.0, 0.0), (0.0, 0.0), (0.3, 0.0))
    assert world.hop(0, 1, 0.0).snr_db == world.hop(0, 2, 0.0).snr_db == 60.0


@pytest.mark.parametrize("known", [{}, {1: Track([(0.0, 100.0, 0.0)])}])
def test_without_both_places_there_is_the_snr_of_the_air_and_no_delay(known):
    world = World(AIR, known)
    assert world.hop(1, 2, 5.0) == world.hop(2, 1, 5.0) == (17.0, 0.0, 0.0, 0.0)


def test_an_override_holds_both_ways():
    world = placed((0.0, 0.0), (0.0, 100.0), links=[LinkOverride(sender=0, receiver=1, snr_db=3.0)])
    assert world.hop(0, 1, 0.0).snr_db == world.hop(1, 0, 0.0).snr_db == 3.0


def test_a_one_way_override_leaves_the_way_back_as_it_is():
    link = LinkOverride(sender=0, receiver=1, snr_db=3.0, one_way=True)
    world = placed((0.0, 0.0), (0.0, 100.0), links=[link])
    assert world.hop(0, 1, 0.0).snr_db == 3.0
    assert world.hop(1, 0, 0.0).snr_db == pytest.approx(20.0)


@pytest.mark.parametrize("first", [0, 1])
def test_each_way_may_have_an_override_of_its_own_in_any_order(first):
    links = [
        LinkOverride(sender=0, receiver=1, snr_db=3.0),
        LinkOverride(sender=1, receiver=0, snr_db=9.0),
    ]
    world = World(AIR, {}, links if first == 0 else links[::-1])
    assert world.hop(0, 1, 0.0).snr_db == 3.0
    assert world.hop(1, 0, 0.0).snr_db == 9.0


def test_an_override_of_two_nodes_says_nothing_about_others():
    world = World(AIR, {}, [LinkOverride(sender=0, receiver=1, snr_db=3.0)])
    assert {world.hop(*pair, 0.0).snr_db for pair in [(0, 2), (2, 0), (1, 2), (2, 1)]} == {17.0}


def test_an_override_of_delay_alone_is_on_top_of_the_places():
    link = LinkOverride(sender=0, receiver=1, delay_s=0.25)
    hop = placed((0.0, 0.0), (0.0, 100.0), links=[link]).hop(0, 1, 0.0)
    assert hop.snr_db == pytest.approx(20.0)
    assert hop.delay_s == pytest.approx(0.25 + 100 / SPEED_OF_LIGHT, abs=1e-15)


@pytest.mark.parametrize(("snr_db", "is_heard"), [(-300.0, False), (-299.9, True)])
def test_at_300_db_below_noise_there_is_nothing(snr_db, is_heard):
    link = LinkOverride(sender=0, receiver=1, snr_db=snr_db, one_way=True)
    overridden = World(AIR, {}, [link])
    assert (overridden.hop(0, 1, 0.0) is not None) is is_heard
    assert overridden.hop(1, 0, 0.0) is not None
    whole = World(AirParams(snr_db=snr_db), {})
    assert (whole.hop(0, 1, 0.0) is not None) is is_heard


def test_what_comes_nearer_is_heard_higher_and_what_goes_away_lower():
    """Carrier and symbols are both faster by v / c."""
    tracks = {
        0: Track([(0.0, 0.0, 0.0)]),
        1: Track([(0.0, 3000.0, 0.0), (10.0, 0.0, 0.0), (20.0, 0.0, -3000.0), (30.0, 0.0, -3e3)]),
    }
    world = World(AIR, tracks)
    ppm = 1e6 * 300 / SPEED_OF_LIGHT
    for pair in [(0, 1), (1, 0)]:
        for t in (5.0, 9.9):
            assert world.hop(*pair, t).doppler_ppm == pytest.approx(ppm, rel=1e-6)
        for t in (10.1, 19.9):
            assert world.hop(*pair, t).doppler_ppm == pytest.approx(-ppm, rel=1e-6)
        assert world.hop(*pair, 25.0).doppler_ppm == 0


def test_who_moves_along_together_has_no_doppler():
    tracks = {i: Track([(0.0, 10.0 * i, 0.0), (1.0, 10.0 * i + 500, 0.0)]) for i in (0, 1)}
    hop = World(AIR, tracks).hop(0, 1, 0.5)
    assert (hop.doppler_ppm, hop.speed_m_s) == pytest.approx((0, 0), abs=1e-9)


@pytest.mark.parametrize(("other", "speed_m_s"), [((0, 3), 5), ((5, 3), 0), ((-5, 3), 10)])
def test_echoes_change_as_fast_as_two_move_past_each_other(other, speed_m_s):
    """Even where the distance does not change, as when they are side by side."""
    per_s, beside = other
    tracks = {
        0: Track([(0.0, -50.0, 0.0), (20.0, 50.0, 0.0)]),
        1: Track([(0.0, -10.0 * per_s, beside), (20.0, 10.0 * per_s, beside)]),
    }
    hop = World(AIR, tracks).hop(0, 1, 10.0)
    assert hop.speed_m_s == pytest.approx(speed_m_s)
    assert abs(hop.doppler_ppm) < 0.01


def test_an_outage_begins_with_its_first_moment_and_ends_before_its_last():
    is_heard = between([(1.0, 2.0)])
    assert all(is_heard(t) for t in (0.0, np.nextafter(1.0, 0), 2.0, 9.0))
    assert not any(is_heard(t) for t in (1.0, 1.5, np.nextafter(2.0, 0)))


@law(300)
@given(
    st.lists(
        st.tuples(st.integers(0, 40), st.integers(0, 40)).map(lambda at: tuple(sorted(at))),
        max_size=8,
    ),
    st.sampled_from([0.0, 0.5]),
)
@example([(0, 10), (1, 2)], 0.0)
def test_any_outages_are_out_when_one_of_them_is(outages, between_s):
    """Outages in any order, nested or consecutive."""
    is_heard = between(outages)
    for t in range(-1, 42):
        at = t + between_s
        assert is_heard(at) is not any(begin <= at < end for begin, end in outages), at
