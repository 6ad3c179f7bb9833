"""Recordings of a robot's drive, as rosbag would have made them: many topics, real messages."""

from heapq import merge

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

TOPICS = {
    "/odom": ("nav_msgs/msg/Odometry", 20.0),
    "/imu/data": ("sensor_msgs/msg/Imu", 50.0),
    "/fix": ("sensor_msgs/msg/NavSatFix", 5.0),
    "/scan": ("sensor_msgs/msg/LaserScan", 10.0),
    "/tf": ("tf2_msgs/msg/TFMessage", 30.0),
    "/map": ("nav_msgs/msg/OccupancyGrid", 0.5),
    "/image/compressed": ("sensor_msgs/msg/CompressedImage", 2.0),
    "/chatter": ("std_msgs/msg/String", 1.0),
}
"""Type and rate in Hz."""


def drive(duration_s):
    """Message times of a drive in order: (topic, type, ns)."""
    streams = [
        [(int((i + 0.1) * 1e9 / rate_hz), topic, kind) for i in range(int(duration_s * rate_hz))]
        for topic, (kind, rate_hz) in TOPICS.items()
    ]
    return [(topic, kind, time_ns) for time_ns, topic, kind in merge(*streams)]


def filled(types, kind, rng):
    """A message of that type with content in every field."""
    return types.types[kind](
        **{name: _value(types, node, rng) for name, node in types.get_msgdef(kind).fields}
    )


def _value(types, node, rng):
    form, *rest = node
    match form.name, rest:
        case "BASE", [(base, _)]:
            return _base(base, rng)
        case "NAME", [name]:
            return filled(types, name, rng)
        case _, [(inner, n)]:
            # The bound of an unbounded sequence is 0.
            n = n if form.name == "ARRAY" else int(rng.integers(1, 40))
            if inner[0].name == "BASE" and inner[1][0] not in ("string", "octet"):
                dtype = "bool" if inner[1][0] == "bool" else inner[1][0]
                return (rng.random(n) * 100).astype(dtype)
            return [_value(types, inner, rng) for _ in range(n)]
    raise AssertionError(node)


def _base(base, rng):
    if base == "string":
        return rng.bytes(int(rng.integers(0, 20))).hex()
    if base == "bool":
        return bool(rng.integers(2))
    return float(np.float32(rng.random())) if base.startswith("float") else int(rng.integers(100))


def ros2_drive(path, storage, duration_s):
    """Write a rosbag2 of a drive; returns the messages written."""
    types, rng = get_typestore(Stores.ROS2_HUMBLE), np.random.default_rng(1)
    written = []
    with Writer2(path, version=9, storage_plugin=storage) as writer:
        connections = {
            topic: writer.add_connection(topic, kind, typestore=types)
            for topic, (kind, _) in TOPICS.items()
        }
        for topic, kind, time_ns in drive(duration_s):
            cdr = bytes(types.serialize_cdr(filled(types, kind, rng), kind))
            writer.write(connections[topic], time_ns, cdr)
            written.append((topic, kind, time_ns, cdr))
    return written


def ros1_drive(path, compression, duration_s):
    """Write a ROS 1 bag of a drive; returns topics, types and times."""
    types, rng = get_typestore(Stores.ROS1_NOETIC), np.random.default_rng(1)
    frames = "geometry_msgs/TransformStamped[] transforms\n"
    types.register(get_types_from_msg(frames, TOPICS["/tf"][0]))
    writer = Writer1(path)
    if compression is not None:
        writer.set_compression(compression)
    with writer:
        connections = {
            topic: writer.add_connection(topic, kind, typestore=types)
            for topic, (kind, _) in TOPICS.items()
        }
        for topic, kind, time_ns in drive(duration_s):
            message = filled(types, kind, rng)
            writer.write(connections[topic], time_ns, types.serialize_ros1(message, kind))
    return drive(duration_s)
