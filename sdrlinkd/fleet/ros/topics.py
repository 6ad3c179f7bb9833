"""Messages of robots as topics of this gateway's node."""

from dataclasses import dataclass, field
from typing import NamedTuple

from sdrlinkd.adapters import type_hash
from sdrlinkd.fleet.ros.attachment import Attachment
from sdrlinkd.fleet.ros.graph import Graph, Opened
from sdrlinkd.fleet.ros.names import (
    UNKNOWN_HASH,
    Qos,
    Role,
    at_robot,
    data_key,
    dds_type,
    is_name,
)
from sdrlinkd.fleet.samples import Putter
from sdrlinkd.fleet.session import Session

MOST_TOPICS = 2048
ENCODING = "application/cdr;from=sdrlink-gateway"
"""Tells other gateways that a message comes from a robot, and is no command to it."""
MOST_HASHES = 8
"""Hashes of one topic's type that are learnt."""


class About(NamedTuple):
    """What a robot says of its topic; `latched` is the number of messages that are kept.

    `hash` is the beginning of the hash of its type in hex digits; empty: unknown.
    """

    latched: int = 0
    is_best_effort: bool = False
    hash: str = ""


@dataclass
class _Topic:
    name: str
    kind: str
    """As in DDS."""
    about: About
    qos: str
    opened: Opened
    hash: str
    """Empty: unknown."""
    n_put: int = 0
    puts: dict[str, Putter] = field(default_factory=dict)
    """How to put a message, by the hash."""


class Topics:
    """Puts messages where ROS 2 nodes expect them.

    Where this gateway does not know the hash of a type, it learns it from the subscriptions.
    """

    def __init__(self, graph: Graph, session: Session) -> None:
        self._graph = graph
        self._session = session
        self._topics: dict[int, dict[tuple[str, str], _Topic]] = {}
        """By robot, and by name there and type."""

    def put(
        self, robot: int, name: str, kind: str, payload: bytes, sent_ns: int, qos: str,
        about: About,
    ) -> None:  # fmt: skip
        """Put a message of a robot's topic `name` of type `kind`.

        It was sent at `sent_ns`, in ns since 1970. `qos` is the class that sets Zenoh's priority.
        """
        topics = self._topics.get(robot, {})
        topic = topics.get((name, kind))
        if topic is not None and topic.about != about:
            _take_down(topics.pop((name, kind)))
            topic = None
        if topic is None:
            topic = self._open(at_robot(robot, name), kind, qos, about)
            if topic is None:
                return
            self._topics.setdefault(robot, {})[name, kind] = topic
        topic.n_put += 1
        attachment = Attachment(topic.n_put, sent_ns, topic.opened.gid).build()
        for hash_ in self._hashes(topic):
            self._put_for(topic, hash_)(payload, attachment)

    def close(self, robot: int) -> None:
        """Take down the topics of a robot, and what is kept of them."""
        for topic in self._topics.pop(robot, {}).values():
            _take_down(topic)

    def _open(self, name: str, kind: str, qos: str, about: About) -> _Topic | None:
        dds = dds_type(kind)
        is_full = sum(map(len, self._topics.values())) >= MOST_TOPICS
        if not dds or not is_name(name) or is_full:
            return None
        hash_ = type_hash(kind)
        if about.hash and not hash_.removeprefix("RIHS01_").startswith(about.hash):
            # The robot's type has other fields than the one known here.
            hash_ = ""
        depth = about.latched or 10
        profile = Qos(about.is_best_effort, bool(about.latched), depth)
        opened = self._graph.open(Role.PUBLISHER, name, dds, hash_ or UNKNOWN_HASH, profile)
        return _Topic(name, dds, about, qos, opened, hash_)

    def _hashes(self, topic: _Topic) -> list[str]:
        """The hashes under which subscriptions expect a topic."""
        found = self._graph.hashes(topic.name, topic.kind)
        if topic.hash:
            # Where ROS has no hashes yet, as in Humble, the keys say so.
            return [topic.hash, *(each for each in found if each == UNKNOWN_HASH)]
        beginning = f"RIHS01_{topic.about.hash}"
        fit = [each for each in found if each.startswith(beginning) or not topic.about.hash]
        return fit[:MOST_HASHES]

    def _put_for(self, topic: _Topic, hash_: str) -> Putter:
        put = topic.puts.get(hash_)
        if put is None:
            key = data_key(self._graph.domain, topic.name, topic.kind, hash_)
            put = topic.puts[hash_] = self._session.publisher(
                key, topic.qos, ENCODING, topic.about.latched
            )
        return put


def _take_down(topic: _Topic) -> None:
    topic.opened.close()
    for put in topic.puts.values():
        put.end()
