"""The demonstration's source: a bag or the built-in robot, with a registry for it."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

from sdrlinkd.adapters import BagMessage, BagTopic, BuiltInRobot, first_seconds, open_bag
from sdrlinkd.config import load_registry
from sdrlinkd.errors import UserError
from sdrlinkd.wire import Registry, make_registry

NAMESPACE = "robot_1"
BUILT_IN_DURATION_S = 15.0
# The sixteenth topic id is for the control channel: ages and beacons.
MAX_BAG_TOPICS = 15

# The registry of the paper's Table 4.
BUILT_IN_REGISTRY = (
    ("scan", "sensor_msgs/LaserScan"),
    ("odom", "nav_msgs/Odometry"),
    ("imu", "sensor_msgs/Imu"),
    ("cmd_vel", "geometry_msgs/Twist"),
    ("map", "nav_msgs/OccupancyGrid"),
    ("clock", "rosgraph_msgs/Clock"),
)


class Recording(Protocol):
    """A recording that can be played: a bag, or the built-in robot."""

    damage: str

    def topics(self) -> list[BagTopic]:
        """The topics of the recording."""

    def messages(self) -> Iterator[BagMessage]:
        """The recording's messages in order of time."""

    def close(self) -> None:
        """Close the recording's files."""


@dataclass
class Source:
    """A recording, the registry under which it is sent, and the topics left out."""

    title: str
    recording: Recording
    registry: Registry
    namespace: str
    duration_s: float
    topics: list[BagTopic]
    left_out: list[str] = field(default_factory=list)
    fastest_hz: float = 300.0
    """Upper limit of the topics' rates in Hz, as far as known."""

    def messages(self) -> Iterator[BagMessage]:
        """The messages to send, in order of time."""
        wanted = {topic.name for topic in self.topics}
        messages = first_seconds(self.recording.messages(), self.duration_s)
        return (message for message in messages if message.topic in wanted)

    def expected(self) -> int:
        """The number of messages to send."""
        if self.duration_s == float("inf"):
            return sum(topic.n_messages for topic in self.topics)
        # Only reading all of them shows how many there are.
        return sum(1 for _ in self.messages())


def open_source(
    bag: Path | None,
    registry_path: Path | None,
    topics: list[str],
    duration_s: float | None,
    seed: int,
    namespace: str = NAMESPACE,
    topics_key: str = "--topics",
) -> Source:
    """The source for a bag, or for a built-in robot in `namespace`. Raises UserError.

    `topics_key` is the option or key by which a person selected `topics`, for errors.
    """
    if bag is None:
        source = _built_in(registry_path, duration_s or BUILT_IN_DURATION_S, seed, namespace)
    else:
        source = _from_bag(bag, registry_path, duration_s or float("inf"))
    if topics:
        _select(source, topics, topics_key)
    if not source.topics:
        raise UserError(f"{source.title}: no topic left to send")
    return source


def _built_in(registry_path: Path | None, duration_s: float, seed: int, namespace: str) -> Source:
    robot = BuiltInRobot(namespace, duration_s, seed)
    registry = load_registry(registry_path) if registry_path else make_registry(BUILT_IN_REGISTRY)
    # The robot's duration already limits its messages.
    endless = float("inf")
    topics = robot.topics()
    source = Source(
        "built-in robot", robot, registry, namespace, endless, topics,
        fastest_hz=max(topic.n_messages for topic in topics) / duration_s,
    )  # fmt: skip
    _match(source)
    return source


def _from_bag(path: Path, registry_path: Path | None, duration_s: float) -> Source:
    bag = open_bag(path)
    found = [topic for topic in bag.topics() if topic.n_messages]
    left_out = [f"{topic.name}: no messages" for topic in bag.topics() if not topic.n_messages]
    if registry_path:
        registry = load_registry(registry_path)
    else:
        found.sort(key=lambda topic: -topic.n_messages)
        left_out += [
            f"{topic.name}: a registry made from a bag holds {MAX_BAG_TOPICS} topics"
            for topic in found[MAX_BAG_TOPICS:]
        ]
        found = sorted(found[:MAX_BAG_TOPICS])
        if not found:
            raise UserError(f"{path}: contains no messages")
        registry = make_registry([(topic.name, topic.type) for topic in found], str(path))
    source = Source(path.name, bag, registry, "", duration_s, found, left_out)
    _match(source)
    return source


def _match(source: Source) -> None:
    """Leave out topics that the registry does not have."""
    prefix = f"/{source.namespace}/" if source.namespace else "/"
    kept = []
    for topic in source.topics:
        entry = source.registry.by_name(topic.name.removeprefix(prefix))
        if entry is None:
            source.left_out.append(f"{topic.name}: not in the registry")
        elif entry.type != topic.type:
            source.left_out.append(
                f"{topic.name}: type {topic.type}, but the registry has {entry.type}"
            )
        else:
            kept.append(topic)
    source.topics = kept


def _select(source: Source, names: list[str], key: str) -> None:
    wanted = {name if name.startswith("/") else f"/{name}" for name in names}
    with_namespace = (
        {f"/{source.namespace}{name}" for name in wanted} if source.namespace else set()
    )
    known = {topic.name for topic in source.topics}
    unknown = [n for n in wanted if n not in known and f"/{source.namespace}{n}" not in known]
    if unknown:
        raise UserError(
            f"{key}: got {', '.join(sorted(unknown))}; allowed: {', '.join(sorted(known))}"
        )
    source.topics = [t for t in source.topics if t.name in wanted | with_namespace]
