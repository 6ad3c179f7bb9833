"""What tests look at, piece by piece; not part of the interface."""

from sdrlinkd.fleet.alarm import Alarm
from sdrlinkd.fleet.bridge import MOST_REMEMBERED, MOST_TOPICS, MOST_WAITING, Bridge
from sdrlinkd.fleet.downward import DownwardCommands
from sdrlinkd.fleet.heard_robot import HeardRobot, Upward
from sdrlinkd.fleet.heard_robots import HeardRobots
from sdrlinkd.fleet.keys import Token
from sdrlinkd.fleet.last_values import OVERHEAD, LastValues
from sdrlinkd.fleet.names import NamedRecently
from sdrlinkd.fleet.other_gateways import OtherGateways
from sdrlinkd.fleet.putting import Lane
from sdrlinkd.fleet.report import BRIDGE, DOWN, UP, Counts
from sdrlinkd.fleet.ros import About, FromRos, RosSide
from sdrlinkd.fleet.ros.attachment import Attachment
from sdrlinkd.fleet.ros.calls import MOST_ASKED, MOST_PROXIES, MOST_RESULTS, Calls
from sdrlinkd.fleet.ros.graph import MOST_KNOWN, Graph
from sdrlinkd.fleet.ros.names import (
    UNKNOWN_HASH,
    Node,
    Qos,
    Role,
    dds_type,
    gid,
    is_name,
    read_data_key,
    read_endpoint,
    robot_in,
    ros_type,
)
from sdrlinkd.fleet.ros.side import MOST_TAKEN
from sdrlinkd.fleet.ros.topics import ENCODING, MOST_HASHES, Topics
from sdrlinkd.fleet.ros.topics import MOST_TOPICS as MOST_PUT
from sdrlinkd.fleet.samples import Putter, Question, Sample
from sdrlinkd.fleet.session import AT_ONCE, MOST_QUERIES, Session
from sdrlinkd.fleet.session import MOST_WAITING as MOST_SAMPLES
from sdrlinkd.fleet.subscriber import MOST_WAITING as MOST_MESSAGES
from sdrlinkd.fleet.upward import UpwardMessages

__all__ = [
    "AT_ONCE",
    "BRIDGE",
    "DOWN",
    "ENCODING",
    "MOST_ASKED",
    "MOST_HASHES",
    "MOST_KNOWN",
    "MOST_MESSAGES",
    "MOST_PROXIES",
    "MOST_PUT",
    "MOST_QUERIES",
    "MOST_REMEMBERED",
    "MOST_RESULTS",
    "MOST_SAMPLES",
    "MOST_TAKEN",
    "MOST_TOPICS",
    "MOST_WAITING",
    "OVERHEAD",
    "UNKNOWN_HASH",
    "UP",
    "About",
    "Alarm",
    "Attachment",
    "Bridge",
    "Calls",
    "Counts",
    "DownwardCommands",
    "FromRos",
    "Graph",
    "HeardRobot",
    "HeardRobots",
    "Lane",
    "LastValues",
    "NamedRecently",
    "Node",
    "OtherGateways",
    "Putter",
    "Qos",
    "Question",
    "Role",
    "RosSide",
    "Sample",
    "Session",
    "Token",
    "Topics",
    "Upward",
    "UpwardMessages",
    "dds_type",
    "gid",
    "is_name",
    "read_data_key",
    "read_endpoint",
    "robot_in",
    "ros_type",
]
