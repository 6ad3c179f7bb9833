"""Small bags in every format, with their known content."""

from random import Random

from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from sdrlinkd.adapters import BuiltInRobot

CUSTOM = "demo_msgs/msg/Reading"
CUSTOM_DEFINITION = "std_msgs/Header header\nfloat32 value\nstring unit\n"


def ros2_bag(path, storage, messages):
    """A rosbag2 folder with messages (topic, type, ns, cdr)."""
    types = get_typestore(Stores.ROS2_HUMBLE)
    with Writer2(path, version=9, storage_plugin=storage) as writer:
        connections = {}
        for topic, kind, time_ns, cdr in messages:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=types)
            writer.write(connections[topic], time_ns, cdr)
    return path


def noisy_messages(seed, count):
    """Odometry and strings with bytes that no serializer would make: garbage in the padding."""
    rng = Random(seed)
    return [
        (
            ("/odom", "nav_msgs/msg/Odometry", 1_000 * i, b"\0\1\0\0" + rng.randbytes(720))
            if i % 3
            else ("/chat", "std_msgs/msg/String", 1_000 * i, b"\0\1\0\0" + rng.randbytes(17))
        )
        for i in range(count)
    ]


def robot_bag(path):
    """A rosbag2 folder with two seconds of the built-in robot."""
    types = get_typestore(Stores.ROS2_HUMBLE)
    robot = BuiltInRobot("", 2.0, 1)
    with Writer2(path, version=9) as writer:
        connections = {
            each.name: writer.add_connection(
                each.name.replace("//", "/"), each.type, typestore=types
            )
            for each in robot.topics()
        }
        for message in robot.messages():
            writer.write(connections[message.topic], message.time_ns, message.cdr)
    return path


def ros1_bag(path, compression, count):
    """A ROS 1 bag with poses and a type that no other package has."""
    types = get_typestore(Stores.ROS1_NOETIC)
    types.register(get_types_from_msg(CUSTOM_DEFINITION, CUSTOM))
    header_type = types.types["std_msgs/msg/Header"]
    time_type = types.types["builtin_interfaces/msg/Time"]
    vector, twist = types.types["geometry_msgs/msg/Vector3"], types.types["geometry_msgs/msg/Twist"]
    writer = Writer1(path)
    if compression is not None:
        writer.set_compression(compression)
    with writer:
        moves = writer.add_connection("/cmd_vel", "geometry_msgs/msg/Twist", typestore=types)
        readings = writer.add_connection("/reading", CUSTOM, typestore=types)
        for i in range(count):
            move = twist(vector(float(i), 0.0, 0.0), vector(0.0, 0.0, 0.5))
            writer.write(moves, 1_000 * i, types.serialize_ros1(move, "geometry_msgs/msg/Twist"))
            header = header_type(seq=i, stamp=time_type(i, 5), frame_id="probe")
            reading = types.types[CUSTOM](header, i / 2, "K")
            writer.write(readings, 1_000 * i + 1, types.serialize_ros1(reading, CUSTOM))
    return path


STORAGES = {"sqlite3": StoragePlugin.SQLITE3, "mcap": StoragePlugin.MCAP}
