"""What tests look at, piece by piece; not part of the interface."""

from sdrlinkd.fleet.bridge import MOST_WAITING, Bridge
from sdrlinkd.fleet.report import BRIDGE, Counts
from sdrlinkd.fleet.ros.attachment import Attachment
from sdrlinkd.fleet.ros.calls import MOST_ASKED, MOST_RESULTS, Calls
from sdrlinkd.fleet.ros.names import Node, Qos, Role, gid, read_data_key, read_endpoint, robot_in
from sdrlinkd.fleet.samples import Question, Sample

__all__ = [
    "BRIDGE",
    "MOST_ASKED",
    "MOST_RESULTS",
    "MOST_WAITING",
    "Attachment",
    "Bridge",
    "Calls",
    "Counts",
    "Node",
    "Qos",
    "Question",
    "Role",
    "Sample",
    "gid",
    "read_data_key",
    "read_endpoint",
    "robot_in",
]
