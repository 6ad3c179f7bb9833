"""The topics that other robots declare."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

from sdrlinkd.errors import PduError
from sdrlinkd.wire import (
    FIRST_NUMBER,
    Description,
    Registry,
    TopicPiece,
    parse_description,
    read_origin,
)

MOST_TOLD = 3
"""Most refused declarations of a robot that a notice names."""


class HeardTopic(NamedTuple):
    """A topic of another robot: its name and type, and the id under which it is counted."""

    base: int
    name: str
    type: str
    about: Description | None = None

    @property
    def at_origin(self) -> str:
        """Its name at the robot whose topic it is."""
        return read_origin(self.name).name

    def origin(self, src: int) -> int:
        """The robot whose topic it is, where robot `src` sends it."""
        robot = read_origin(self.name).robot
        return src if robot is None else robot


@dataclass(slots=True)
class _Source:
    known: dict[int, HeardTopic] = field(default_factory=dict)
    checks: dict[int, int] = field(default_factory=dict)
    pieces: dict[int, dict[int, bytes]] = field(default_factory=dict)
    """Pieces of the description that a number's check belongs to."""


class HeardTopics:
    """What the numbers of each source mean, by its TOPIC records.

    `has_numbers`: this robot understands declared topics. `own_hash` is the known hash of a type at
    this robot, zeros if unknown.
    """

    def __init__(
        self, registry: Registry, has_numbers: bool, own_hash: Callable[[str], bytes]
    ) -> None:
        self._registry = registry
        self.has_numbers = has_numbers
        self._not_understood: set[int] = set()
        self._own_hash = own_hash
        self._sources: dict[int, _Source] = {}
        self.version = 0
        """Counts the changes of what is known."""
        self.changed: list[tuple[int, int]] = []
        """(source, number) whose meaning has changed and was not taken yet."""
        self.refused: dict[int, dict[int, str]] = {}
        """Numbers whose declarations were refused, and why, by source."""

    def topic(self, src: int, topic_id: int) -> HeardTopic | None:
        """The topic that an id of source `src` means; None if that is not known."""
        if topic_id < FIRST_NUMBER:
            found = self._registry.by_id(topic_id)
            return None if found is None else HeardTopic(topic_id, found.name, found.type)
        source = self._sources.get(src)
        return None if source is None else source.known.get(topic_id)

    def differs(self, topic: HeardTopic) -> bool:
        """Whether a declared topic has another type than in our registry, or its type other fields
        than here.
        """
        if topic.about is None:
            return False
        registered = self._registry.by_name(topic.at_origin)
        if registered is not None and registered.type != topic.type:
            return True
        if not any(topic.about.hash_):
            return False
        own = self._own_hash(topic.type)
        return any(own) and own != topic.about.hash_

    def take(self, src: int, piece: TopicPiece) -> bool:
        """Take a TOPIC record of robot `src`; True if the meaning of its number is now known."""
        number, check, at, n, data = piece
        if not self.has_numbers:
            self._not_understood.add(src)
            return False
        if number < FIRST_NUMBER or at >= n:
            return False
        source = self._sources.setdefault(src, _Source())
        if source.checks.get(number) != check:
            source.checks[number] = check
            source.pieces[number] = {}
            self._forget_number(src, source, number)
        if number in source.known:
            return False
        there = source.pieces[number]
        there[at] = data
        if any(i not in there for i in range(n)):
            return False
        try:
            about = parse_description(b"".join(there[i] for i in range(n)), check)
            _check(source, about)
        except PduError as error:
            self.refused.setdefault(src, {})[number] = error.detail
            return False
        finally:
            there.clear()
        for other, topic in list(source.known.items()):
            if topic.name == about.name and _kind(topic.about) != _kind(about):
                # Its newest word counts: the producer has begun anew with another type.
                self._forget_number(src, source, other)
        same = (topic.base for topic in source.known.values() if topic.name == about.name)
        base = next(same, number)
        self.refused.get(src, {}).pop(number, None)
        source.known[number] = HeardTopic(base, about.name, about.type, about)
        self.version += 1
        return True

    def forget(self, src: int) -> None:
        """Forget what a robot declared, as it has restarted."""
        source = self._sources.pop(src, None)
        self.refused.pop(src, None)
        self._not_understood.discard(src)
        if source is not None:
            self.version += 1
            self.changed += [(src, number) for number in source.known]

    def take_changed(self) -> list[tuple[int, int]]:
        """(source, number) whose meaning has changed since the last call."""
        changed, self.changed = self.changed, []
        return changed

    def declared(self) -> dict[int, list[HeardTopic]]:
        """The declared topics by source, each name once."""
        return {
            src: list({topic.name: topic for topic in source.known.values()}.values())
            for src, source in self._sources.items()
        }

    def notices(self) -> list[str]:
        """What a person should know about others' declarations, in sentences."""
        notices = [
            f"robot {src} declares topics beyond the registry, which this robot takes only with "
            "`auto = true`"
            for src in sorted(self._not_understood)
        ]
        notices += [
            f"robot {src} declares topics that cannot be used ({len(refused)}): "
            f"{'; '.join(list(refused.values())[:MOST_TOLD])}"
            for src, refused in sorted(self.refused.items())
            if refused
        ]
        for src, topics in sorted(self.declared().items()):
            notices += [
                f"robot {src} sends {topic.name} as {topic.type} with hash {_hash(topic)}, but "
                f"here it is {self._ours(topic)}; its messages are dropped (rx_other_type): use "
                "the same type, from the same version of its package"
                for topic in topics
                if self.differs(topic)
            ]
        return notices

    def _forget_number(self, src: int, source: _Source, number: int) -> None:
        """Forget what a number meant; other numbers of its name are counted under one of them."""
        if source.known.pop(number, None) is None:
            return
        self.version += 1
        self.changed.append((src, number))
        left = [other for other, topic in source.known.items() if topic.base == number]
        for other in left:
            source.known[other] = source.known[other]._replace(base=left[0])
            self.changed.append((src, other))

    def _ours(self, topic: HeardTopic) -> str:
        registered = self._registry.by_name(topic.at_origin)
        kind = topic.type if registered is None else registered.type
        return f"{kind} with hash {self._own_hash(kind).hex()}"


def _check(source: _Source, about: Description) -> None:
    """Raise PduError if a name differs from another one of its source by case only."""
    for topic in source.known.values():
        if topic.name != about.name and topic.name.lower() == about.name.lower():
            raise PduError(
                "rx_control_bad",
                f"{about.name} differs from {topic.name} by upper and lower case only",
            )


def _kind(about: Description | None) -> tuple[str, bytes] | None:
    """What all numbers of a topic have in common."""
    return None if about is None else (about.type, about.hash_)


def _hash(topic: HeardTopic) -> str:
    return "unknown" if topic.about is None else topic.about.hash_.hex()
