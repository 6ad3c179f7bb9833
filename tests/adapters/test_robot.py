"""The built-in robot: repeatable, and physically one thing."""

import math
from collections import Counter

import numpy as np
import pytest

from sdrlinkd.adapters import BuiltInRobot, first_seconds, from_cdr, paced
from sdrlinkd.adapters.bags import BagMessage
from sdrlinkd.adapters.robot import ROOM_HALF_M, Pose


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


@pytest.mark.parametrize("t", [0.3, 1.7, 5.2, 11.0])
def test_velocity_and_turn_rate_are_derivatives(t):
    d = 1e-5
    a, b, pose = Pose(t - d), Pose(t + d), Pose(t)
    assert math.hypot(b.x - a.x, b.y - a.y) / (2 * d) == pytest.approx(pose.speed, rel=1e-4)
    assert (b.heading - a.heading) / (2 * d) == pytest.approx(pose.turn_rate, rel=1e-3)
    assert (b.speed - a.speed) / (2 * d) == pytest.approx(pose.acceleration, rel=1e-3, abs=1e-6)


class FakeTime:
    """A clock that sleeping moves."""

    def __init__(self):
        self.now = 100.0

    def clock(self):
        return self.now

    def sleep(self, seconds):
        self.now += seconds


def at(*seconds):
    return [BagMessage("/a", "b/msg/C", round(s * 1e9), b"") for s in seconds]


def test_pace_is_absolute_and_a_late_message_delays_no_other():
    fake, seen = FakeTime(), []
    for message in paced(at(5, 6, 7, 9), 2.0, fake.clock, fake.sleep):
        seen.append(round(fake.now - 100, 6))
        if message.time_ns == 6_000_000_000:
            fake.now += 0.8  # the consumer dawdles past the next message's time
    assert seen == [0.0, 0.5, 1.3, 2.0]


def test_first_seconds():
    assert first_seconds(at(5, 5.5, 6, 6.01), 1.0)
    assert [m.time_ns for m in first_seconds(at(5, 5.5, 6, 6.01), 1.0)] == [
        5_000_000_000,
        5_500_000_000,
    ]
