"""The policies in force: those of the file, with the changes made since."""

import logging
from collections.abc import Callable, Mapping
from typing import Any

import msgspec

from sdrlinkd.config import Setup, explain_policy
from sdrlinkd.errors import UserError
from sdrlinkd.link import Link, TopicPolicy

log = logging.getLogger("sdrlinkd")

FIXED = ("dictionary", "stamp", "stop")
"""Keys that cannot be changed at run time: receivers must know two of them, and the stop message is
made at the start."""


class Policies:
    """Changes policies of single topics while the daemon runs."""

    def __init__(self, setup: Setup, link: Link) -> None:
        self._setup = setup
        self._link = link
        self.changed: dict[int, set[str]] = {}
        """Keys that were set since the file was read, by topic id."""
        self.announce: Callable[[Mapping[int, TopicPolicy]], None] | None = None
        """Called with the policies in force after a change."""
        link.set_policies(setup.policies)

    def reload(self, policies: Mapping[int, TopicPolicy]) -> None:
        """Put the policies of the file in force again."""
        self.changed.clear()
        self._link.set_policies(policies)
        self._announce()

    def topic_id(self, name: str) -> int:
        """The id of a topic by its bus name or registry name. Raises UserError."""
        registry, config = self._setup.registry, self._setup.config
        prefix = f"/{config.namespace.strip('/')}/"
        topic = registry.by_name(name.removeprefix(prefix)) or registry.by_name(name)
        if topic is None:
            raise UserError(
                f"topic {name}: unknown; allowed: {registry.suggest(name)} (as read at the start)"
            )
        return topic.id

    def set(self, name: str, changes: Mapping[str, Any]) -> dict[str, Any]:
        """Apply `changes`; returns the values before and after.

        Raises UserError and then changes nothing.
        """
        topic_id = self.topic_id(name)
        known = [key for key in TopicPolicy.__struct_fields__ if key not in FIXED]
        for key in changes:
            if key not in known:
                raise UserError(f"{key}: cannot be set; allowed: {', '.join(known)}")
        old = self._link.policy(topic_id)
        merged = {**msgspec.structs.asdict(old), **changes}
        try:
            new = msgspec.convert(merged, TopicPolicy)
        except msgspec.ValidationError:
            raise UserError(explain_policy(changes)) from None
        self._link.set_policy(topic_id, new)
        self.changed.setdefault(topic_id, set()).update(changes)
        # Report the policy as the link has it, not as it was given.
        new = self._link.policy(topic_id)
        self._announce()
        told = {key: _told(getattr(new, key)) for key in changes}
        log.info("policy of %s: %s", self._setup.registry.topics[topic_id].name, told)
        return {
            "topic": self._setup.registry.topics[topic_id].name,
            "old": {key: _told(getattr(old, key)) for key in changes},
            "new": told,
        }

    def _announce(self) -> None:
        if self.announce is not None:
            topics = self._setup.registry.topics
            self.announce({topic.id: self._link.policy(topic.id) for topic in topics})


def _told(value: object) -> object:
    """A value as JSON can express it, which has no infinity."""
    return "inf" if value == float("inf") else value
