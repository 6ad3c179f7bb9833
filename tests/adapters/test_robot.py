"""The built-in robot: repeatable, and physically consistent."""

import math
from collections import Counter

import numpy as np
import pytest

from sdrlinkd.adapters import BuiltInRobot, from_cdr
from sdrlinkd.adapters.testing import ROOM_HALF_M, Pose


@pytest.fixture(scope="module")
def messages():
    return list(BuiltInRobot("robot_1", 4.0, 7).messages())


def test_same_seed_same_bytes(messages):
    assert messages == list(BuiltInRobot("robot_1", 4.0, 7).messages())
    assert messages != list(BuiltInRobot("robot_1", 4.0, 8).messages())


def test_rates_and_order(messages):
    assert Counter(m.topic for m in messages) == {
        "/robot_1/odom": 120, "/robot_1/imu": 200, "/robot_1/scan": 40, "/robot_1/cmd_vel": 40,
    }  # fmt: skip
    assert [m.time_ns for m in messages] == sorted(m.time_ns for m in messages)


def test_odometry_is_where_the_robot_is(messages):
    for message in (m for m in messages if m.topic.endswith("odom")):
        pose = Pose(message.time_ns * 1e-9)
        odom = from_cdr(message.cdr, message.type)
        assert len(message.cdr) == 724
        assert (
            math.hypot(odom.pose.pose.position.x - pose.x, odom.pose.pose.position.y - pose.y)
            < 0.02
        )
        stamp = odom.header.stamp
        assert stamp.sec * 10**9 + stamp.nanosec == pytest.approx(message.time_ns, abs=1)


def test_the_laser_sees_the_walls(messages):
    for message in (m for m in messages if m.topic.endswith("scan")):
        pose = Pose(message.time_ns * 1e-9)
        scan = from_cdr(message.cdr, message.type)
        angles = pose.heading + scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))
        x = pose.x + scan.ranges * np.cos(angles)
        y = pose.y + scan.ranges * np.sin(angles)
        assert np.abs(np.maximum(np.abs(x), np.abs(y)) - ROOM_HALF_M).max() < 0.06
        assert np.isfinite(scan.ranges).all()
        assert (scan.range_min, scan.range_max) == (pytest.approx(0.12), 18)
        assert scan.range_min <= scan.ranges.min() <= scan.ranges.max() <= scan.range_max


@pytest.mark.parametrize("seconds", [0.1, 1.0, 2.55])
def test_the_topic_list_tells_the_counts(seconds):
    robot = BuiltInRobot("/robot_1/", seconds, 3)
    counts = Counter(m.topic for m in robot.messages())
    assert {t.name: t.n_messages for t in robot.topics()} == counts


@pytest.mark.parametrize("t", [0.3, 1.7, 5.2, 11.0])
def test_velocity_and_turn_rate_are_derivatives(t):
    d = 1e-5
    a, b, pose = Pose(t - d), Pose(t + d), Pose(t)
    assert math.hypot(b.x - a.x, b.y - a.y) / (2 * d) == pytest.approx(pose.speed, rel=1e-4)
    assert (b.heading - a.heading) / (2 * d) == pytest.approx(pose.turn_rate, rel=1e-3)
    assert (b.speed - a.speed) / (2 * d) == pytest.approx(pose.acceleration, rel=1e-3, abs=1e-6)


def test_odometry_tells_the_velocity_of_the_path(messages):
    for message in (m for m in messages if m.topic.endswith("odom")):
        t, d = message.time_ns * 1e-9, 1e-5
        a, b = Pose(t - d), Pose(t + d)
        odom = from_cdr(message.cdr, message.type)
        twist, turn = odom.twist.twist, odom.pose.pose.orientation
        assert twist.linear.x == pytest.approx(math.hypot(b.x - a.x, b.y - a.y) / (2 * d), rel=1e-4)
        assert twist.angular.z == pytest.approx(
            math.remainder(b.heading - a.heading, 2 * math.pi) / (2 * d), rel=1e-3, abs=1e-5
        )
        heading = math.atan2(b.y - a.y, b.x - a.x)
        off = math.remainder(2 * math.atan2(turn.z, turn.w) - heading, 2 * math.pi)
        assert off == pytest.approx(0, abs=1e-4)
