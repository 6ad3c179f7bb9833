"""Takes topics that producers declare while the daemon runs."""

import fnmatch
import logging
import time
from math import inf
from typing import TYPE_CHECKING, Any

import msgspec

from sdrlinkd.bus import Bus, shown
from sdrlinkd.config import TF_TYPE, Setup
from sdrlinkd.errors import DeclarationError
from sdrlinkd.link import HeardTopic, Link
from sdrlinkd.offers import Declaration
from sdrlinkd.policies import Policies
from sdrlinkd.wire import FIRST_NUMBER, read_origin, topic_type

if TYPE_CHECKING:
    # Its package imports the bag readers, which the daemon on a robot does not need.
    from sdrlinkd.adapters import Transforms

SAID_S = 5.0
"""Time in s for which what a program says of itself is shown."""

log = logging.getLogger("sdrlinkd")


class Declaring:
    """Joins the parts that a new topic concerns: the link, its policy, [tf], and the bus.

    `transforms` are the filters of transforms by topic id; those of declared topics are added.
    """

    def __init__(
        self,
        setup: Setup,
        link: Link,
        policies: Policies,
        bus: Bus,
        transforms: "dict[int, Transforms]",
    ) -> None:
        self._setup = setup
        self._link = link
        self._policies = policies
        self._bus = bus
        self._transforms = transforms
        self._said, self._said_at = "", -inf

    def declare(self, now: float, arguments: dict[str, Any]) -> dict[str, Any]:
        """Take a topic, and return what became of it. Raises DeclarationError."""
        try:
            declaration = msgspec.convert(arguments, Declaration)
        except msgspec.ValidationError as error:
            raise DeclarationError(f"declare: {error}") from None
        name = self._setup.name_on_air(declaration.name)
        self._check_name(declaration.name, name)
        is_filtered = name in self._setup.transforms
        if is_filtered and topic_type(declaration.type) != TF_TYPE:
            raise DeclarationError(
                f"{name}: got type {declaration.type[:128]}; allowed for topics in tf.topics: "
                f"{TF_TYPE}"
            )
        topic = self._link.declare(declaration.offer(name), now)
        if is_filtered and topic.id not in self._transforms:
            # This imports the message types, which are slow to load.
            from sdrlinkd.adapters import Transforms

            self._transforms[topic.id] = Transforms(self._setup.config.tf)
        policy = self._policies.offer(topic.id, declaration)
        is_new = self._bus.accept(declaration.name, topic)
        self._policies.announce_all()
        if is_new:
            log.info("%s (%s) declared, %s", declaration.name, topic.type, declaration.words)
        return {
            "topic": declaration.name,
            "name": topic.name,
            "type": topic.type,
            "number": topic.id,
            "robot": self._setup.node_id,
            "depth": policy.depth,
            "lifespan_s": policy.lifespan_s,
            "durability": policy.durability,
        }

    def undeclare(self, arguments: dict[str, Any]) -> dict[str, Any]:
        """Note that a topic's last producer has ended: another type may take its name at once.

        Raises DeclarationError for a topic that nobody declared.
        """
        given = str(arguments.get("name", ""))
        topic = self._link.topic_named(self._setup.name_on_air(given))
        if topic is None or topic.id < FIRST_NUMBER:
            raise DeclarationError(f"name: got {shown(given)!r}; allowed: a declared topic")
        kind = str(arguments.get("type", topic.type))
        if topic_type(kind) != topic.type:
            raise DeclarationError(f"{given}: got type {shown(kind)}; it is {topic.type} now")
        self._link.undeclare(topic.id)
        return {"topic": given, "type": topic.type}

    def _check_name(self, given: str, name: str) -> None:
        """Raise DeclarationError if a bus topic cannot be that of the topic `name` on the air."""
        if not given.startswith("/"):
            raise DeclarationError(f"name: got {given[:128]!r}; allowed: a name with leading slash")
        self._check_origin(given, name)
        known = self._link.topic_named(name)
        if known is None:
            return
        other = self._bus.names_in().get(known.id)
        if other is None:
            raise DeclarationError(
                f"{given}: the daemon does not take {name} from the bus (the key `topics`)"
            )
        if other != given:
            raise DeclarationError(
                f"{given}: on the air it has the name of {other}, {name}; use one of the two"
            )

    def _check_origin(self, given: str, name: str) -> None:
        """Raise DeclarationError for another robot's topic that this one must not send."""
        robot, topic = read_origin(name)
        if robot is None:
            return
        allowed = self._setup.config.fleet.bridge
        if robot == self._setup.node_id or not any(fnmatch.fnmatchcase(topic, p) for p in allowed):
            raise DeclarationError(
                f"{given}: messages of robot {robot} appear under this name; a daemon sends those "
                f"of other robots, of topics in fleet.bridge ({', '.join(allowed) or 'none'})"
            )

    def demand(self, now: float, arguments: dict[str, Any]) -> dict[str, Any]:
        """Which topics other robots want, by bus topic, and the version of their declarations.

        The argument `says` is what the program that asks has to say of itself, for people.
        """
        if (says := arguments.get("says")) is not None:
            self._said, self._said_at = shown(str(says)), time.monotonic()
        names = self._bus.names_in()
        wanted = {
            names[topic.id]: robots
            for name, robots in self._link.demand(now).items()
            if (topic := self._link.topic_named(name)) is not None and topic.id in names
        }
        return {"boot": self._bus.boot, "version": self._link.heard_version, "wanted": wanted}

    def said(self) -> list[str]:
        """What the program that asks for the demand said of itself lately."""
        return [self._said] if time.monotonic() - self._said_at < SAID_S else []

    def declared(self) -> list[dict[str, Any]]:
        """The topics that other robots declared, with the bus topics of their messages.

        A topic that comes from a robot itself, and over a gateway, is named once, as the robot's.
        """
        found: dict[str, tuple[int, HeardTopic]] = {}
        for src, topics in sorted(self._link.heard_topics().items()):
            for topic in topics:
                name = self._setup.republished(src, topic.name)
                if name not in found or topic.origin(src) == src:
                    found[name] = src, topic
        return [
            {
                "robot": topic.origin(src),
                "via": src,
                "name": topic.at_origin,
                "type": topic.type,
                "hash": topic.about.hash_.hex() if topic.about and any(topic.about.hash_) else "",
                "latched": topic.about.depth if topic.about else 0,
                "best_effort": bool(topic.about and topic.about.is_best_effort),
                "topic": name,
            }
            for name, (src, topic) in found.items()
        ]
