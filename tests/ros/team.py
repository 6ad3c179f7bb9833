"""Robots of a team: a daemon on simulated air, a bridge, and a node in a domain of its own."""

import json
import struct

from sdrlinkd.client import ControlClient
from tests.ros.programs import Agent, Bridge, new_domain
from tests.waiting import wait_for

WAIT_S = 60.0
ODOM = ("/odom", "nav_msgs/msg/Odometry", 30)
SCAN = ("/scan", "sensor_msgs/msg/LaserScan", 10)
IMU = ("/imu", "sensor_msgs/msg/Imu", 50)
TWIST = "geometry_msgs/msg/Twist"
GRID = "nav_msgs/msg/OccupancyGrid"
TEXT = "std_msgs/msg/String"
# The wheels have no tf2_msgs, so another type carries the octets of its messages.
CARRIER = "std_msgs/msg/ByteMultiArray"


def config(hub, robot, more=""):
    """What a robot of this air needs: its id, the radio's rate, and who shares the air."""
    return (
        f'registry = ""\nnamespace = "robot_{robot}"\nbackend = "ether"\n'
        f'[ether]\ndir = "{hub}"\n[modem]\nrate_hz = 1e6\nmcs = 5\n[access]\nnodes = [1, 2]\n{more}'
    )


def ask(daemon, verb, **arguments):
    with ControlClient(daemon.directory) as control:
        return control.ask(verb, arguments)


def transforms(child):
    """A TFMessage in CDR with the frame `child`, of at most 7 characters.

    No package with its type can be installed here, but the daemon knows it. So the same octets are
    a CARRIER, too: the label of its dimension reaches from the nanoseconds to the end of the parent
    frame, and the length of its data is the low half of x.
    """
    parent, frame = b"base_link\0", child.encode() + b"\0"
    assert len(frame) <= 8
    head = struct.pack("<I", 1) + struct.pack("<iI", 8 + len(parent), 8)
    head += struct.pack("<I", len(parent)) + parent
    head += bytes(-len(head) % 4) + struct.pack("<I", len(frame)) + frame
    rest = struct.pack("<I6d", 0x3FF00000, 2, 3, 0, 0, 0, 1)
    return (b"\0\1\0\0" + head + bytes(-len(head) % 8) + struct.pack("<I", len(rest)) + rest).hex()


class Robot:
    """A robot: its daemon, its bridge, and a node in a domain of its own."""

    def __init__(self, start, daemon, *arguments):
        self.start, self.daemon, self.arguments = start, daemon, arguments
        self.domain = new_domain()
        self.node = start(Agent, self.domain, "node")
        self.bridge = None

    def bridged(self):
        self.bridge = self.start(Bridge, self.domain, self.daemon.directory, *self.arguments)
        return self

    def states(self):
        """What the bridge tells of each topic on /link/topics."""
        told = json.loads(self.node.last(topic="/link/topics")[0])
        return [(each["topic"], each["state"]) for each in told]

    def watched(self):
        self.node.sub(topic="/link/topics", type=TEXT)
        return self

    def says_of(self, topic, text):
        wait_for(lambda: self.node.count(topic="/link/topics") > 0, WAIT_S)
        wait_for(lambda: any(topic == t and text in s for t, s in self.states()), WAIT_S)

    def superseded(self, topic):
        """How many messages of a topic were replaced by newer ones: a busy machine has such."""
        topics = self.daemon.snapshot().link.topics
        return sum(each.dropped.get("tx_superseded", 0) for each in topics if each.name == topic)

    @property
    def samples_lost(self):
        counters = ask(self.daemon, "status")["carrier"]["counters"]
        return sum(counters[name] for name in ("overflows", "samples_lost", "bursts_missed"))


def is_part(some, whole):
    """Whether `some` is `whole` in its order, of which messages may be missing."""
    rest = iter(whole)
    return all(each in rest for each in some)


def matched(robot, *topics, n=1):
    for topic in topics:
        wait_for(lambda topic=topic: robot.node.matched(topic=topic) == n, WAIT_S)
