"""The topic registry: the name and type of each topic id (wire document, section 7)."""

import hashlib
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import ClassVar

from sdrlinkd.errors import RegistryError

MAX_TOPICS = 16
DECLARED_TOPIC_ID = 0xE
CONTROL_TOPIC_ID = 0xF
BROADCAST = 0xFF
"""The robot id that means all robots."""

_NAME = re.compile(r"/?[A-Za-z_]\w*(/[A-Za-z_]\w*)*", re.ASCII)
_TYPE = re.compile(r"([A-Za-z]\w*)/(?:msg/)?([A-Za-z]\w*)", re.ASCII)
# Accepted header lines; the second one is the paper's.
_HEADERS = (["name", "type"], ["topic", "type"])


def is_topic_name(name: str) -> bool:
    """Whether `name` is a topic name: parts joined by slashes, perhaps with a leading slash."""
    return _NAME.fullmatch(name) is not None


def topic_type(text: str) -> str | None:
    """A type in the form `pkg/msg/Name`, given so or as `pkg/Name`; None if it is none."""
    found = _TYPE.fullmatch(text)
    return f"{found[1]}/msg/{found[2]}" if found else None


@dataclass(frozen=True, slots=True)
class Topic:
    """A topic; `name` has no leading slash, `type` has the form `pkg/msg/Name`."""

    id: int
    name: str
    type: str


@dataclass(frozen=True, slots=True)
class RegistryDigest:
    """Digest by which two nodes compare registries: 8 bytes over all, and one byte per topic."""

    overall: bytes
    per_topic: bytes

    OVERALL_SIZE: ClassVar = 8

    @classmethod
    def from_bytes(cls, value: bytes) -> "RegistryDigest":
        """The digest in the value of a DIGEST record."""
        return cls(value[: cls.OVERALL_SIZE], value[cls.OVERALL_SIZE :])

    def shortened(self) -> "RegistryDigest":
        """The digest without the octets per topic, for PDUs too small for them."""
        return RegistryDigest(self.overall, b"")

    def differing_ids(self, other: "RegistryDigest") -> list[int]:
        """Topic ids that differ between two registries, as far as single octets show."""
        if self.overall == other.overall or not (self.per_topic and other.per_topic):
            return []
        most = max(len(self.per_topic), len(other.per_topic))
        mine = self.per_topic.ljust(most, b"\0")
        theirs = other.per_topic.ljust(most, b"\0")
        longer = range(min(len(self.per_topic), len(other.per_topic)), most)
        return [i for i in range(most) if mine[i] != theirs[i] or i in longer]


class Registry:
    """Maps names to topic ids and back; topic ids follow the order of the lines."""

    def __init__(self, topics: Sequence[Topic]) -> None:
        self.topics = tuple(topics)
        self._by_name = {topic.name: topic for topic in topics}

    def __len__(self) -> int:
        return len(self.topics)

    @property
    def leaves_numbers(self) -> bool:
        """Whether topic id 0xE is free for declared topics and large messages."""
        return len(self.topics) <= DECLARED_TOPIC_ID

    @property
    def has_control(self) -> bool:
        """Whether topic id 0xF is the control channel, i.e. the registry has at most 15 topics."""
        return len(self.topics) < MAX_TOPICS

    def by_id(self, topic_id: int) -> Topic | None:
        """The topic under `topic_id`, or None."""
        return self.topics[topic_id] if topic_id < len(self.topics) else None

    def by_name(self, name: str) -> Topic | None:
        """The topic called `name` (with or without leading slash), or None."""
        return self._by_name.get(name.removeprefix("/"))

    def suggest(self, name: str) -> str:
        """A suggestion for error messages, of the name that `name` may be meant to be."""
        close = get_close_matches(name.removeprefix("/"), self._by_name, n=1)
        hint = f"; did you mean {close[0]}?" if close else ""
        return f"the registry has {', '.join(self._by_name) or 'no topics'}{hint}"

    def digest(self, dictionaries: Mapping[int, int] | None = None) -> RegistryDigest:
        """The digest over ids, names and types (wire document, section 7.2).

        `dictionaries`: ids of the zstd dictionaries of topics that have one.
        """
        known = dictionaries or {}
        lines = [
            f"{topic.id},{topic.name},{topic.type}"
            f"{f',{known[topic.id]}' if topic.id in known else ''}\n".encode()
            for topic in self.topics
        ]
        return RegistryDigest(
            overall=hashlib.sha256(b"".join(lines)).digest()[: RegistryDigest.OVERALL_SIZE],
            per_topic=bytes(hashlib.sha256(line).digest()[0] for line in lines),
        )

    def csv(self) -> str:
        """The registry as a CSV that `parse_registry` reads back."""
        return "".join(f"{topic.name},{topic.type}\n" for topic in self.topics)


def parse_registry(text: str, source: str = "registry") -> Registry:
    """The registry in CSV text, with one `name,type` per line (wire document, 7.1).

    Empty lines, `#` comments and a header `name,type` or `Topic, Type` are skipped. Raises
    RegistryError, which cites `source` and the line.
    """
    pairs: list[tuple[str, str, str]] = []
    for number, raw in enumerate(text.removeprefix("\ufeff").split("\n"), start=1):
        line = raw.split("#", 1)[0].strip()
        fields = [field.strip() for field in line.split(",")]
        if not line or (not pairs and [each.lower() for each in fields] in _HEADERS):
            continue
        if len(fields) != 2:
            raise RegistryError(
                f"{source}:{number}: got {raw.strip()!r}; a line is `name,type`, "
                "for example `odom,nav_msgs/msg/Odometry`"
            )
        pairs.append((fields[0], fields[1], f"{source}:{number}"))
    return _assemble(pairs, source)


def make_registry(pairs: Iterable[tuple[str, str]], source: str = "registry") -> Registry:
    """The registry of (name, type) pairs. Raises RegistryError like `parse_registry`."""
    return _assemble([(name, kind, source) for name, kind in pairs], source)


def _assemble(pairs: list[tuple[str, str, str]], source: str) -> Registry:
    topics: list[Topic] = []
    seen: dict[str, str] = {}
    for raw_name, raw_type, where in pairs:
        if not is_topic_name(raw_name):
            raise RegistryError(
                f"{where}: topic name {raw_name!r}; allowed: ROS names such as odom or camera/image"
            )
        kind = topic_type(raw_type)
        if kind is None:
            raise RegistryError(
                f"{where}: type {raw_type!r}; allowed: package/Name or package/msg/Name"
            )
        name = raw_name.removeprefix("/")
        if name in seen:
            raise RegistryError(f"{where}: topic {name} is listed twice, first at {seen[name]}")
        seen[name] = where
        topics.append(Topic(len(topics), name, kind))
    if len(topics) > MAX_TOPICS:
        raise RegistryError(
            f"{source}: {len(topics)} topics; allowed: at most {MAX_TOPICS - 1}, or {MAX_TOPICS} "
            f"without ages, beacons and link reports (a PDU's topic id has 4 bits); remove "
            f"{len(topics) - MAX_TOPICS + 1} lines, the same ones at all robots"
        )
    if not topics:
        raise RegistryError(f"{source}: no topics; write at least one line such as "
                            "`odom,nav_msgs/Odometry`")  # fmt: skip
    return Registry(topics)
