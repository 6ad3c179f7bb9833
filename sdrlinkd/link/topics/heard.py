"""The topics that other robots declare."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

from sdrlinkd.errors import PduError
from sdrlinkd.wire import (
    FIRST_NUMBER,
    MAX_NAME,
    Description,
    Registry,
    TopicPiece,
    parse_description,
    read_origin,
)

MOST_TOLD = 3
"""Most refused declarations of a robot that a notice names, and most robots of a notice."""
FREE = 4
"""So many of a robot's topics are taken even if others declare too many."""
MOST_OF_ONE, MOST_OF_ALL = 128, 1024
"""Most declared topics of a robot, and of all together beyond these: each costs memory and time for
ever."""
MOST_OCTETS = 2 * MAX_NAME + 16
"""Longest description in octets."""


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
    numbers: dict[str, list[int]] = field(default_factory=dict)
    """Numbers of each name, the one under which it is counted first."""
    folded: dict[str, str] = field(default_factory=dict)
    """Names by their lower case."""
    checks: dict[int, int] = field(default_factory=dict)
    pieces: dict[int, dict[int, bytes]] = field(default_factory=dict)
    """Pieces of the description that a number's check belongs to."""
    version: int = 0
    """That of all topics at the last change of this robot's."""


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
        self._n_beyond = 0
        """Declared topics of all robots, without the FREE ones of each."""
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
        if sum(map(len, there.values())) > MOST_OCTETS:
            there.clear()
            return False
        if any(i not in there for i in range(n)):
            return False
        try:
            about = parse_description(b"".join(there[i] for i in range(n)), check)
            self._check(source, about)
        except PduError as error:
            self.refused.setdefault(src, {})[number] = error.detail
            return False
        finally:
            there.clear()
        for other in source.numbers.get(about.name, [])[:]:
            if _kind(source.known[other].about) != _kind(about):
                # Its newest word counts: the producer has begun anew with another type.
                self._forget_number(src, source, other)
        if about.name not in source.numbers:
            self._n_beyond += len(source.numbers) >= FREE
            source.numbers[about.name] = []
        numbers = source.numbers[about.name]
        numbers.append(number)
        source.folded[about.name.lower()] = about.name
        self.refused.get(src, {}).pop(number, None)
        source.known[number] = HeardTopic(numbers[0], about.name, about.type, about)
        self._changes(source)
        return True

    def forget(self, src: int) -> None:
        """Forget what a robot declared, as it has restarted."""
        source = self._sources.pop(src, None)
        self.refused.pop(src, None)
        self._not_understood.discard(src)
        if source is not None:
            self.version += 1
            self._n_beyond -= max(0, len(source.numbers) - FREE)
            self.changed += [(src, number) for number in source.known]

    def take_changed(self) -> list[tuple[int, int]]:
        """(source, number) whose meaning has changed since the last call."""
        changed, self.changed = self.changed, []
        return changed

    def declared(self) -> dict[int, list[HeardTopic]]:
        """The declared topics by source, each name once."""
        return {src: self.declared_by(src) for src in self._sources}

    def declared_by(self, src: int) -> list[HeardTopic]:
        """The declared topics of a source, each name once."""
        source = self._sources[src]
        return [source.known[numbers[0]] for numbers in source.numbers.values()]

    def versions(self) -> dict[int, int]:
        """The version at which what each source declared changed last."""
        return {src: source.version for src, source in self._sources.items()}

    def notices(self) -> list[str]:
        """What a person should know about others' declarations, in sentences."""
        beyond = [
            f"robot {src} declares topics beyond the registry, which this robot takes only with "
            "`auto = true`"
            for src in sorted(self._not_understood)
        ]
        refused = [
            f"robot {src} declares topics that cannot be used ({len(refused)}): "
            f"{'; '.join(list(refused.values())[:MOST_TOLD])}"
            for src, refused in sorted(self.refused.items())
            if refused
        ]
        differing = [
            f"robot {src} sends {topic.name} as {topic.type} with hash {_hash(topic)}, but "
            f"here it is {self._ours(topic)}; its messages are dropped (rx_other_type): use "
            "the same type, from the same version of its package"
            for src in sorted(self._sources)
            for topic in self.declared_by(src)
            if self.differs(topic)
        ]
        return [*_some(beyond), *_some(refused), *_some(differing)]

    def _check(self, source: _Source, about: Description) -> None:
        """Raise PduError if a source cannot have one more topic, or not one of that name."""
        if about.name in source.numbers:
            return
        other = source.folded.get(about.name.lower(), about.name)
        if other != about.name:
            raise PduError(
                "rx_control_bad", f"{about.name} differs from {other} by upper and lower case only"
            )
        n = len(source.numbers)
        if n >= MOST_OF_ONE:
            raise PduError(
                "rx_control_bad", f"{about.name}: got one more; allowed: {MOST_OF_ONE} of a robot"
            )
        if n >= FREE and self._n_beyond >= MOST_OF_ALL:
            raise PduError(
                "rx_control_bad",
                f"{about.name}: got one more; allowed: {MOST_OF_ALL} of all robots together",
            )

    def _changes(self, source: _Source) -> None:
        self.version += 1
        source.version = self.version

    def _forget_number(self, src: int, source: _Source, number: int) -> None:
        """Forget what a number meant; other numbers of its name are counted under one of them."""
        topic = source.known.pop(number, None)
        if topic is None:
            return
        self._changes(source)
        self.changed.append((src, number))
        left = source.numbers[topic.name]
        left.remove(number)
        if not left:
            del source.numbers[topic.name], source.folded[topic.name.lower()]
            self._n_beyond -= len(source.numbers) >= FREE
        elif topic.base == number:
            for other in left:
                source.known[other] = source.known[other]._replace(base=left[0])
                self.changed.append((src, other))

    def _ours(self, topic: HeardTopic) -> str:
        registered = self._registry.by_name(topic.at_origin)
        kind = topic.type if registered is None else registered.type
        return f"{kind} with hash {self._own_hash(kind).hex()}"


def _some(sentences: list[str]) -> list[str]:
    """The first sentences, and how many more there are."""
    more = len(sentences) - MOST_TOLD
    return sentences if more <= 0 else [*sentences[:MOST_TOLD], f"and {more} more like the last"]


def _kind(about: Description | None) -> tuple[str, bytes] | None:
    """What all numbers of a topic have in common."""
    return None if about is None else (about.type, about.hash_)


def _hash(topic: HeardTopic) -> str:
    return "unknown" if topic.about is None else topic.about.hash_.hex()
