"""Keys and liveliness tokens of ROS 2 nodes on rmw_zenoh.

Source: the design document of rmw_zenoh (github.com/ros2/rmw_zenoh, docs/design.md).
"""

import re
from enum import StrEnum
from typing import NamedTuple

import xxhash

TOKENS = "@ros2_lv"
UNKNOWN_HASH = "TypeHashNotSupported"
"""What stands for the hash of a type where it is not known."""
_ROOT = "%"
_KIND = re.compile(r"(\w+)/(msg|srv|action)/(\w+)", re.ASCII)
_DDS = re.compile(r"(\w+)::(msg|srv|action)::dds_::(\w+)_", re.ASCII)
_AT_ROBOT = re.compile(r"/robot_(0|[1-9][0-9]{0,2})/(.+)", re.ASCII)
_HASH = re.compile(r"RIHS01_[0-9a-f]{64}")
_NAME = re.compile(r"(/[A-Za-z_]\w*)+", re.ASCII)


class Role(StrEnum):
    """What a node has: what the two letters in a token mean."""

    PUBLISHER = "MP"
    SUBSCRIPTION = "MS"
    SERVICE = "SS"


class Qos(NamedTuple):
    """The QoS that a token tells."""

    is_best_effort: bool = False
    is_latched: bool = False
    depth: int = 10

    def text(self) -> str:
        """As in a token: reliability, durability, history, and four times the default."""
        reliability, durability = "2" * self.is_best_effort, "1" * self.is_latched
        return f"{reliability}:{durability}:,{self.depth}:,:,:,,"


class Endpoint(NamedTuple):
    """A publisher, a subscription or a service of a node, by its token.

    `session` is the id of the Zenoh session, `name` the topic's or the service's with its slash,
    `kind` the type as in DDS and `hash` that of the type, as in `RIHS01_…`.
    """

    session: str
    node: str
    role: Role
    name: str
    kind: str
    hash: str


class Node(NamedTuple):
    """A node in a domain, on a Zenoh session."""

    domain: int
    session: str
    name: str

    @property
    def token(self) -> str:
        """The key of the token that the node is there."""
        return f"{TOKENS}/{self.domain}/{self.session}/0/0/NN/{_ROOT}/{_ROOT}/{self.name}"

    def endpoint(self, number: int, role: Role, name: str, kind: str, hash_: str, qos: Qos) -> str:
        """The key of the token of an endpoint, with a number of its own."""
        return (
            f"{TOKENS}/{self.domain}/{self.session}/0/{number}/{role}/{_ROOT}/{_ROOT}/{self.name}/"
            f"{name.replace('/', _ROOT)}/{kind}/{hash_}/{qos.text()}"
        )


def read_endpoint(token: str) -> Endpoint | None:
    """The endpoint in the key of a token; None for a node, and for what cannot be read."""
    chunks = token.split("/")
    if len(chunks) != 13 or chunks[5] not in {*Role}:
        return None
    name = chunks[9].replace(_ROOT, "/")
    is_hash = _HASH.fullmatch(chunks[11]) or chunks[11] == UNKNOWN_HASH
    if not is_name(name) or not ros_type(chunks[10]) or not is_hash:
        # A wildcard would match what others put.
        return None
    return Endpoint(chunks[2], chunks[8], Role(chunks[5]), name, chunks[10], chunks[11])


def tokens(domain: int) -> str:
    """The key of all tokens in a domain."""
    return f"{TOKENS}/{domain}/**"


def dds_type(kind: str) -> str:
    """A type such as `nav_msgs/msg/Odometry` as in DDS; empty if it is none."""
    found = _KIND.fullmatch(kind)
    return f"{found[1]}::{found[2]}::dds_::{found[3]}_" if found else ""


def ros_type(kind: str) -> str:
    """The type of a type as in DDS; empty if it is none."""
    found = _DDS.fullmatch(kind)
    return f"{found[1]}/{found[2]}/{found[3]}" if found else ""


def at_robot(robot: int, name: str) -> str:
    """A robot's topic or service `name`, with its slash, as it appears in the graph."""
    return f"/robot_{robot}{name}"


def robot_in(name: str) -> tuple[int, str] | None:
    """(robot, name there without slash) of what `at_robot` made; None for any other name."""
    found = _AT_ROBOT.fullmatch(name)
    return (int(found[1]), found[2]) if found else None


def is_name(name: str) -> bool:
    """Whether it is a name of a topic or a service, with its slash."""
    return _NAME.fullmatch(name) is not None


def data_key(domain: int, name: str, kind: str, hash_: str) -> str:
    """The key of a topic's messages, or of a service's calls; `kind` as in DDS."""
    return f"{domain}{name}/{kind}/{hash_}"


class Data(NamedTuple):
    """What the key of a message says; `kind` as in DDS."""

    name: str
    kind: str


def read_data_key(domain: int, key: str) -> Data | None:
    """The topic and the type in the key of a message; None for any other key."""
    prefix, _, rest = key.partition("/")
    name, _, hashed = rest.rpartition("/")
    name, _, kind = name.rpartition("/")
    return Data(f"/{name}", kind) if prefix == str(domain) and name and hashed else None


def gid(token: str) -> bytes:
    """The 16 octets by which receivers know an endpoint with this token."""
    both = xxhash.xxh3_128_intdigest(token.encode())
    return both.to_bytes(16, "little")
