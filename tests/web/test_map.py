"""Where robots are, their paths, and what is drawn of their links."""

from math import cos, inf, nan, pi, radians

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.adapters import PLACES, empty, to_cdr
from sdrlinkd.reports import FlowReport, RobotLinksReport, RoutesReport
from sdrlinkd.web import World
from sdrlinkd.web.testing import MOST_POINTS, map_paths, map_view, position_in
from tests.laws import law
from tests.reported import neighbor, snapshot
from tests.web.odometry import ODOMETRY, odometry

FIX = "sensor_msgs/msg/NavSatFix"


def fix(latitude, longitude, status=0):
    message = empty(FIX)
    message.latitude, message.longitude, message.status.status = latitude, longitude, status
    return to_cdr(message, FIX)


def world_of(*snapshots):
    world = World()
    for each in snapshots:
        station = world.station(f"at {each.node}", "")
        station.report(each, 0.0)
    return world


def at(world, node):
    return world.stations[f"at {node}"]


def test_all_types_with_a_position_are_read():
    for kind in PLACES:
        assert position_in(2, to_cdr(empty(kind), kind), kind) is not None, kind
    found = position_in(2, odometry(3.0, -4.0, pi / 3), ODOMETRY)
    assert (found.x, found.y, found.heading) == pytest.approx((3.0, -4.0, pi / 3))


@pytest.mark.parametrize("cdr", [odometry(nan, 0), odometry(0, inf), b"", b"\0\1\0\0abc"])
def test_what_is_no_position_is_none(cdr):
    assert position_in(2, cdr, ODOMETRY) is None
    assert position_in(2, fix(1, 2, status=-1), FIX) is None


@law(200)
@given(st.binary(max_size=900), st.sampled_from(sorted(PLACES)))
def test_any_octets_are_a_position_or_none(octets, kind):
    position_in(2, octets, kind)


def test_degrees_become_metres_from_the_first_fix():
    """One minute of latitude is a nautical mile, 1852 m; of longitude, as many times its cosine."""
    world = world_of(snapshot(1))
    for latitude, longitude in ((60.0, 10.0), (60.0 + 1 / 60, 10.0 + 1 / 60)):
        world.take_position(("at 1",), 2, "fix", FIX, fix(latitude, longitude), 0.0)
    (robot,) = [each for each in map_view(world, at(world, 1), 0.0)["robots"] if each["id"] == 2]
    assert robot["y"] == pytest.approx(1852, rel=0.002)
    assert robot["x"] == pytest.approx(1852 * cos(radians(60.0)), rel=0.002)


def test_the_better_topic_wins_and_the_other_one_steps_in_when_it_falls_silent():
    world = world_of(snapshot(1))

    def place(topic, kind, cdr, now):
        world.take_position(("at 1",), 2, topic, kind, cdr, now)
        robots = map_view(world, at(world, 1), now)["robots"]
        return next(each["topic"] for each in robots if each["id"] == 2)

    assert place("fix", FIX, fix(0, 0), 0.0) == "fix"
    assert place("odom", ODOMETRY, odometry(1, 1), 0.1) == "odom"
    assert place("fix", FIX, fix(0, 0), 0.2) == "odom"
    assert place("fix", FIX, fix(0, 0), 9.0) == "fix"


@pytest.mark.slow
@law(60)
@given(st.integers(1, 5000), st.floats(0.001, 50))
def test_a_path_is_thinned_and_ends_where_the_robot_is(n, step_m):
    world = world_of(snapshot(1))
    for i in range(n):
        world.take_position((), 1, "odom", ODOMETRY, odometry(i * step_m, 0.0), 0.1 * i)
    (path,) = map_paths(world, None)
    assert len(path["points"]) <= MOST_POINTS + 1
    assert path["points"][0][0] == 0
    assert path["points"][-1][0] == pytest.approx((n - 1) * step_m, abs=0.01)
    assert path["points"] == sorted(path["points"])


def test_published_and_received_paths_are_apart():
    world = world_of(snapshot(1), snapshot(2))
    world.take_position((), 2, "/robot_2/odom", ODOMETRY, odometry(5, 0), 0.0)
    world.take_position(("at 1",), 2, "/rx_robot_2/odom", ODOMETRY, odometry(4, 0), 0.0)
    paths = {each["sent"]: each["points"] for each in map_paths(world, at(world, 1))}
    assert paths == {True: [(5, 0), (5, 0)], False: [(4, 0), (4, 0)]}
    assert not [each for each in map_paths(world, at(world, 2)) if not each["sent"]]
    world.forget("at 1")
    assert not [each for each in map_paths(world, None) if not each["sent"]]


def test_a_link_says_what_both_ends_measured():
    world = world_of(
        snapshot(1, neighbors=[neighbor(2, snr_db=20.0, per_lately=0.01, mcs=3, per_there=0.9)]),
        snapshot(2, neighbors=[neighbor(1, snr_db=4.0, per_lately=0.2, snr_there_db=19.0)]),
    )
    (link,) = map_view(world, at(world, 1), 0.0)["links"]
    assert link == {
        "a": 1, "b": 2, "snr_a": 20.0, "loss_a": 0.01, "snr_b": 4.0, "loss_b": 0.2, "mcs_a": 3,
        "mcs_b": 0, "hops_a": 1, "hops_b": 1, "level": "poor",
    }  # fmt: skip


def test_links_that_no_station_measures_are_as_the_team_told():
    told = RoutesReport(
        robots=[RobotLinksReport(id=3, told_s_ago=0.0, hears={2: 0.99, 4: 0.5})],
        flows=[FlowReport(src=1, dst=255, forwarded_by=[3], went_around=0)],
    )
    world = world_of(snapshot(1, neighbors=[neighbor(3, snr_db=20.0, per_lately=0.0)], routes=told))
    view = map_view(world, at(world, 1), 0.0)
    assert {(each["a"], each["b"]): each["level"] for each in view["links"]} == {
        (1, 3): "good", (2, 3): "good", (3, 4): "poor",
    }  # fmt: skip
    assert view["flows"] == [{"from": 1, "src": 1, "dst": None, "via": [3]}]
    assert {each["id"]: each["silent"] for each in view["robots"]} == {
        1: False, 2: True, 3: False, 4: True,
    }  # fmt: skip


def test_what_is_old_counts_as_silent_and_draws_no_link():
    world = world_of(snapshot(1, neighbors=[neighbor(2, last_heard_s_ago=30.0)]))
    assert map_view(world, at(world, 1), 0.0)["links"] == []
    world = world_of(snapshot(1, neighbors=[neighbor(2, snr_db=20.0)]))
    view = map_view(world, at(world, 1), 60.0)
    assert view["links"] == []
    assert view["robots"] == [{"id": 1, "silent": True, "level": "DOWN"}]
