"""Bags of real robots, of simulations and of rosbag2's own tests."""

from contextlib import closing
from itertools import pairwise

import pytest

from sdrlinkd.adapters import open_bag


@pytest.mark.parametrize(
    ("name", "count"),
    [
        ("bags/sqlite3/husky_real_first100s", 4252),
        ("bags/sqlite3/mrclam7_robots123_30s", 5731),
        ("bags/mcap/nav2_turtlebot_sim.mcap", 8197),
        ("bags/ros1/turtlesim_teleop.bag", 8647),
        ("bags/ros1/lidar_stationary_2014.bag", 1265),
        ("cdr/talker.mcap", 20),
    ],
)
def test_real_recordings_are_read_whole(data, name, count):
    with closing(open_bag(data / name)) as bag:
        messages = list(bag.messages())
        assert bag.damage == ""
    assert len(messages) == count
    assert all(a.time_ns <= b.time_ns for a, b in pairwise(messages))
