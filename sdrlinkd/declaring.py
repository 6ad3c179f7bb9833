"""Takes topics that producers declare while the daemon runs."""

import logging
from typing import Any

import msgspec

from sdrlinkd.bus import Bus
from sdrlinkd.config import Setup
from sdrlinkd.errors import DeclarationError
from sdrlinkd.link import Link
from sdrlinkd.offers import Declaration
from sdrlinkd.policies import Policies

log = logging.getLogger("sdrlinkd")


class Declaring:
    """Joins the parts that a new topic concerns: the link, its policy, and the bus."""

    def __init__(self, setup: Setup, link: Link, policies: Policies, bus: Bus) -> None:
        self._setup = setup
        self._link = link
        self._policies = policies
        self._bus = bus

    def declare(self, arguments: dict[str, Any]) -> dict[str, Any]:
        """Take a topic, and return what became of it. Raises DeclarationError."""
        try:
            declaration = msgspec.convert(arguments, Declaration)
        except msgspec.ValidationError as error:
            raise DeclarationError(f"declare: {error}") from None
        name = self._setup.name_on_air(declaration.name)
        self._check_name(declaration.name, name)
        topic = self._link.declare(declaration.offer(name))
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

    def _check_name(self, given: str, name: str) -> None:
        """Raise DeclarationError if a bus topic cannot be that of the topic `name` on the air."""
        if not given.startswith("/"):
            raise DeclarationError(f"name: got {given[:128]!r}; allowed: a name with leading slash")
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

    def declared(self) -> list[dict[str, Any]]:
        """The topics that other robots declared, with the bus topics of their messages."""
        return [
            {
                "robot": src,
                "name": topic.name,
                "type": topic.type,
                "hash": topic.about.hash_.hex() if topic.about and any(topic.about.hash_) else "",
                "latched": topic.about.depth if topic.about else 0,
                "best_effort": bool(topic.about and topic.about.is_best_effort),
                "topic": self._setup.republished(src, topic.name),
            }
            for src, topics in sorted(self._link.heard_topics().items())
            for topic in topics
        ]
