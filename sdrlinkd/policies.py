"""The policies in force: those of the file, with the changes made since."""

import logging
from collections.abc import Callable, Mapping
from typing import Any

import msgspec

from sdrlinkd.config import Setup, explain_policy
from sdrlinkd.errors import UserError
from sdrlinkd.link import DEFAULT_POLICY, Link, Told, TopicPolicy
from sdrlinkd.offers import Declaration, merged
from sdrlinkd.wire import Registry, read_origin

log = logging.getLogger("sdrlinkd")

FIXED = ("dictionary", "from_", "offer", "stamp", "stop", "unproven")
"""Keys that cannot be changed at run time: receivers must know two of them, the stop message is
made at the start, what is set wins over an offer anyway, and whom to trust is for the file."""

_SETTABLE = [key for key in TopicPolicy.__struct_fields__ if key not in FIXED]


class Policies:
    """Changes policies of single topics while the daemon runs."""

    def __init__(self, setup: Setup, link: Link) -> None:
        self._setup = setup
        self._link = link
        self.changed: dict[int, dict[str, Any]] = {}
        """Keys that were set since the file was read, and their values, by topic id."""
        self.announce: Callable[[Mapping[int, TopicPolicy]], None] | None = None
        """Called with the policies in force after a change."""
        self._offers: dict[int, Declaration] = {}
        """What the producers of a topic said of its QoS, by topic id."""
        self._configured: Mapping[str, TopicPolicy] = {}
        self._configure(setup.named_policies)

    def reload(self, policies: Mapping[str, TopicPolicy]) -> None:
        """Put the policies of the file, by topic name, in force again."""
        self.changed.clear()
        self._configure(policies)
        self.announce_all()

    def offer(self, topic_id: int, declaration: Declaration) -> TopicPolicy:
        """Apply what a producer says of its topic, where neither file nor user say otherwise.

        Returns the policy in force.
        """
        known = self._offers.get(topic_id)
        self._offers[topic_id] = declaration if known is None else known.joined(declaration)
        self._link.set_policy(topic_id, self._policy(topic_id))
        return self._link.policy(topic_id)

    def told(self, topic_id: int) -> Told:
        """Where a topic's policy comes from."""
        offer, configured = self._offers.get(topic_id), self._configured_for(topic_id)
        # The file wins, key by key.
        is_offered = offer is not None and merged(configured, offer.policy) != configured
        words = offer.words if offer is not None and is_offered else ""
        return Told(self._setup.source, self.changed.get(topic_id, ()), words)

    def topic_id(self, name: str) -> int:
        """The id of a topic by its bus name or registry name. Raises UserError."""
        link = self._link
        topic = link.topic_named(self._setup.name_on_air(name)) or link.topic_named(name)
        if topic is None:
            known = Registry(link.own_topics)
            raise UserError(f"topic {name}: unknown; allowed: {known.suggest(name)}")
        return topic.id

    def name(self, topic_id: int) -> str:
        """The name of a topic of this robot, with a leading slash."""
        return f"/{self._link.topic(topic_id).name}"

    def policy(self, name: str) -> dict[str, Any]:
        """The policy in force of a topic: the keys that can be set. Raises UserError."""
        found = self._link.policy(self.topic_id(name))
        return {key: _told(getattr(found, key)) for key in _SETTABLE}

    def set(self, name: str, changes: Mapping[str, Any]) -> dict[str, Any]:
        """Apply `changes`; returns the values before and after.

        Raises UserError and then changes nothing.
        """
        topic_id = self.topic_id(name)
        for key in changes:
            if key not in _SETTABLE:
                raise UserError(f"{key}: cannot be set; allowed: {', '.join(_SETTABLE)}")
        old = self._link.policy(topic_id)
        merged = {**msgspec.to_builtins(old), **changes}
        try:
            new = msgspec.convert(merged, TopicPolicy)
        except msgspec.ValidationError:
            raise UserError(explain_policy(changes)) from None
        if new.reserve and not (new.period_s and new.max_bytes):
            raise UserError(
                "reserve: got true; it needs period_s and max_bytes above 0: sdrlinkctl set "
                f"{name} --reserve RATE:SIZE, such as 50:1KB"
            )
        self.changed.setdefault(topic_id, {}).update({k: getattr(new, k) for k in changes})
        self._link.set_policy(topic_id, self._policy(topic_id))
        # Report the policy as the link has it, not as it was given.
        new = self._link.policy(topic_id)
        self.announce_all()
        told = {key: _told(getattr(new, key)) for key in changes}
        name = self._link.topic(topic_id).name
        log.info("policy of %s: %s", name, told)
        return {
            "topic": name,
            "old": {key: _told(getattr(old, key)) for key in changes},
            "new": told,
        }

    def announce_all(self) -> None:
        """Announce the policies in force."""
        if self.announce is not None:
            topics = self._link.own_topics
            self.announce({topic.id: self._link.policy(topic.id) for topic in topics})

    def _configure(self, policies: Mapping[str, TopicPolicy]) -> None:
        self._configured = policies
        for topic in self._link.own_topics:
            self._link.set_policy(topic.id, self._policy(topic.id))
        self._link.set_named_policies(policies)

    def _policy(self, topic_id: int) -> TopicPolicy:
        """The policy by the file and the topic's producers, with what was set since."""
        configured = self._configured_for(topic_id)
        offer = self._offers.get(topic_id)
        policy = configured if offer is None else merged(configured, offer.policy)
        return msgspec.structs.replace(policy, **self.changed.get(topic_id, {}))

    def _configured_for(self, topic_id: int) -> TopicPolicy:
        """The policy by the file; of another robot's topic, that of its name there."""
        name = read_origin(self._link.topic(topic_id).name).name
        return self._configured.get(name, DEFAULT_POLICY)


def _told(value: object) -> object:
    """A value as JSON can express it, which has no infinity."""
    return "inf" if value == float("inf") else value
