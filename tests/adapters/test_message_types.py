"""What the daemon knows of the types of topics that others declare."""

import struct

from sdrlinkd.adapters import MessageTypes
from sdrlinkd.config import Config, make_setup
from sdrlinkd.link import HeardTopic, TopicPolicy
from sdrlinkd.wire import Description


def heard(name, kind):
    return HeardTopic(16, name, kind, Description(name, kind))


def test_headers_and_stop_messages_by_type(tmp_path):
    policy = TopicPolicy(deadman_s=0.5, stop={"linear": {"x": 1.0}})
    types = MessageTypes(make_setup(Config(topic={"cmd_vel": policy}), tmp_path))
    kinds = ("nav_msgs/msg/Odometry", "geometry_msgs/msg/Twist", "my_msgs/msg/Unknown")
    assert [types.has_header(kind) for kind in kinds] == [True, False, False]
    stop = types.stop(heard("robot_1/cmd_vel", "geometry_msgs/msg/Twist"))
    assert stop == b"\0\1\0\0" + struct.pack("<6d", 1.0, 0, 0, 0, 0, 0)
    assert types.stop(heard("cmd_vel", "my_msgs/msg/Unknown")) is None
    assert types.stop(heard("cmd_vel", "std_msgs/msg/String")) is None, "it has no such field"
    assert types.stop(heard("goal", "geometry_msgs/msg/Point")) == b"\0\1\0\0" + bytes(24)
