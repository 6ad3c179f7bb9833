"""This robot's topics: those of the registry, and those that its producers declare."""

import hashlib
from collections import OrderedDict
from collections.abc import Callable, Iterator
from typing import NamedTuple

from sdrlinkd.errors import DeclarationError
from sdrlinkd.wire import (
    FIRST_NUMBER,
    HASH_SIZE,
    LAST_NUMBER,
    MAX_NAME,
    Description,
    Registry,
    Topic,
    is_topic_name,
    pieces,
    read_origin,
    topic_type,
)

MOST_KEYS = 32
"""Most numbers of a topic: one for each producer key."""
IDLE_S = 5.0
"""Time in s without a message or a declaration after which a topic's producers have ended."""
N_NUMBERS = LAST_NUMBER - FIRST_NUMBER + 1


class Offer(NamedTuple):
    """What a producer says of its topic; `hash_` is the beginning of the type's RIHS01 hash.

    `depth` above 0: transient_local, and that many messages of each producer are kept.
    """

    name: str
    type: str
    hash_: bytes = bytes(HASH_SIZE)
    depth: int = 0
    is_best_effort: bool = False


class OwnTopics:
    """The topics of this robot by id, and the numbers of the declared ones on the air.

    Each producer key of a declared topic has a number of its own, so that receivers tell its
    messages apart; the topic's id is its first number. Numbers derive from names, so that a robot
    that restarts mostly uses the same ones. `has_numbers`: topic id 0xE is used for them and for
    large messages. `room` is the largest piece of a description in octets.
    """

    def __init__(self, registry: Registry, has_numbers: bool, room: int) -> None:
        self.registry = registry
        self.has_numbers = has_numbers
        self._room = room
        self._by_id = {topic.id: topic for topic in registry.topics}
        self._by_name = {topic.name: topic for topic in registry.topics}
        self._by_lower = {name.lower(): name for name in self._by_name}
        self._hashes: dict[str, bytes] = {}
        self._keys: dict[int, OrderedDict[str, int]] = {}
        self.told: dict[int, Description] = {}
        """What each number means, for other robots."""
        self.version = 0
        """Counts the changes of `told`."""

    def __iter__(self) -> Iterator[Topic]:
        return iter(list(self._by_id.values()))

    def __getitem__(self, topic_id: int) -> Topic:
        return self._by_id[topic_id]

    def __contains__(self, topic_id: int) -> bool:
        return topic_id in self._by_id

    def by_name(self, name: str) -> Topic | None:
        """The topic called `name` (with or without leading slash), or None."""
        return self._by_name.get(name.removeprefix("/"))

    def hash_of(self, type_: str) -> bytes:
        """The known hash of a type, by its producers here; zeros if unknown."""
        return self._hashes.get(type_, bytes(HASH_SIZE))

    def declare(self, offer: Offer, is_idle: Callable[[int], bool] = lambda _: False) -> Topic:
        """The topic of an offer: one of the registry, a known one, or a new one.

        A declaration with another type, or another hash of it, replaces the earlier one of its
        name if `is_idle(topic id)`: the producer has ended, or has begun anew. The new topic has
        another number, so no message is taken for one of the other type. Raises DeclarationError.
        """
        type_ = topic_type(offer.type)
        if not is_topic_name(read_origin(offer.name).name) or len(offer.name) > MAX_NAME:
            raise DeclarationError(
                f"name: got {offer.name[:MAX_NAME]!r}; allowed: a ROS name such as odom or "
                f"camera/image, of up to {MAX_NAME} characters"
            )
        if type_ is None or len(type_) > MAX_NAME:
            raise DeclarationError(
                f"type: got {offer.type[:MAX_NAME]!r}; allowed: package/msg/Name or package/Name"
            )
        name = offer.name.removeprefix("/")
        about = Description(name, type_, *offer[2:])
        self._note_hash(name, type_, offer.hash_, is_idle)
        known = self._by_name.get(name)
        if known is None:
            return self._new(about)
        told = self.told.get(known.id)
        if known.type != type_ and (told is None or not is_idle(known.id)):
            how = "" if told is None else f" and in use; end that, and try again after {IDLE_S:g} s"
            raise DeclarationError(f"{name}: got type {type_}; it is declared as {known.type}{how}")
        if told is None:
            return known
        if known.type != type_ or _is_other(told.hash_, about.hash_):
            return self._replaced(known, about)
        self._tell(known.id, about)
        return known

    def set_depth(self, topic_id: int, depth: int) -> None:
        """Tell other robots how many messages of a declared topic to keep; 0: it is volatile."""
        if (about := self.told.get(topic_id)) is not None:
            self._tell(topic_id, about._replace(depth=depth))

    def number(self, topic_id: int, key: str) -> int:
        """The number on the air for messages of a topic from the producer `key`."""
        keys = self._keys.get(topic_id)
        if keys is None:
            return topic_id
        number = keys.get(key)
        if number is None:
            number = self._number_for(topic_id, key)
        elif len(keys) > 1:
            keys.move_to_end(key)
        return number

    def _number_for(self, topic_id: int, key: str) -> int:
        keys = self._keys[topic_id]
        number: int | None = topic_id
        if keys:
            is_full = len(keys) >= MOST_KEYS
            number = None if is_full else self._free(f"{self._by_id[topic_id].name}\0{key}")
        if number is None:
            # The producer that was silent for longest gives its number to the new one.
            _, number = keys.popitem(last=False)
        self._note(number, self.told[topic_id])
        keys[key] = number
        return number

    def _replaced(self, known: Topic, about: Description) -> Topic:
        """A topic in place of one that nobody uses; messages of that one may still wait."""
        topic = self._new(about)
        for number in {known.id, *self._keys.pop(known.id).values()}:
            del self.told[number]
        self.version += 1
        return topic

    def _new(self, about: Description) -> Topic:
        name = about.name
        if not self.has_numbers:
            raise DeclarationError(
                f"{name}: {self.registry.suggest(name)}; with `auto = true` producers may declare "
                "topics beyond it"
            )
        alike = self._by_lower.get(name.lower(), name)
        if alike != name:
            raise DeclarationError(f"{name}: differs from {alike} by upper and lower case only")
        number = self._free(name)
        if number is None:
            raise DeclarationError(f"{name}: a robot declares at most {N_NUMBERS} topics")
        try:
            pieces(FIRST_NUMBER, about, self._room)
        except ValueError as error:
            raise DeclarationError(
                f"{error} do not fit into 15 PDUs; use a shorter name, or raise link.pdu_size"
            ) from None
        topic = Topic(number, name, about.type)
        self._by_id[topic.id] = self._by_name[name] = topic
        self._by_lower[name.lower()] = name
        self._keys[topic.id] = OrderedDict()
        self._note(topic.id, about)
        return topic

    def _tell(self, topic_id: int, about: Description) -> None:
        """Give all numbers of a declared topic the meaning `about`."""
        for number in {topic_id, *self._keys[topic_id].values()}:
            self._note(number, about)

    def _note(self, number: int, about: Description) -> None:
        if self.told.get(number) != about:
            self.told[number] = about
            self.version += 1

    def _free(self, text: str) -> int | None:
        """A free number, the same one for the same text as far as possible; None: there is none."""
        first = int.from_bytes(hashlib.sha256(text.encode()).digest()[:4], "big")
        tried = (FIRST_NUMBER + (first + i) % N_NUMBERS for i in range(N_NUMBERS))
        taken = self.told.keys() | self._by_id.keys()
        return next((number for number in tried if number not in taken), None)

    def _note_hash(
        self, name: str, type_: str, hash_: bytes, is_idle: Callable[[int], bool]
    ) -> None:
        known = self.hash_of(type_)
        used = any(not is_idle(each.id) for each in self if each.type == type_)
        if _is_other(known, hash_) and used:
            raise DeclarationError(
                f"{name}: {type_} has hash {hash_.hex()}, but another producer here has "
                f"{known.hex()}: two versions of its package are installed"
            )
        if any(hash_):
            self._hashes[type_] = hash_


def _is_other(known: bytes, hash_: bytes) -> bool:
    """Whether two hashes differ, as far as both are known."""
    return any(known) and any(hash_) and known != hash_
