"""The policies in force: those of the file, with the changes made since."""

import logging
from collections.abc import Callable, Mapping
from typing import Any

import msgspec

from sdrlinkd.config import Setup, explain_policy
from sdrlinkd.errors import UserError
from sdrlinkd.link import DEFAULT_POLICY, Link, PolicyTable, Told, TopicPolicy
from sdrlinkd.offers import Declaration
from sdrlinkd.wire import Registry, Topic, read_origin

log = logging.getLogger("sdrlinkd")

FIXED = ("dictionary", "from_", "key", "offer", "stamp", "stop", "unproven")
"""Keys that cannot be changed at run time: receivers must know two of them, the stop message is
made at the start, what is set wins over an offer anyway, messages that wait have their key, and
whom to trust is for the file."""

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
        self._table = setup.table
        self._configure(setup.table)

    def reload(self, table: PolicyTable) -> None:
        """Put the policies of the file in force again."""
        self.changed.clear()
        self._configure(table)
        self.announce_all()

    def offer(self, topic_id: int, declaration: Declaration) -> TopicPolicy:
        """Apply what a producer says of its topic, where neither file nor user say otherwise.

        Returns the policy in force.
        """
        known = self._offers.get(topic_id)
        self._offers[topic_id] = declaration if known is None else known.joined(declaration)
        self._apply(topic_id)
        return self._link.policy(topic_id)

    def told(self, topic_id: int) -> Told:
        """Where a topic's policy comes from."""
        offer, topic = self._offers.get(topic_id), self._link.topic(topic_id)
        offered = DEFAULT_POLICY if offer is None else offer.policy
        origins = self._table.origins(_name(topic), topic.type, offered)
        return Told(
            self._setup.source,
            self.changed.get(topic_id, ()),
            offer.words if offer is not None and "offer" in origins else "",
            topic.type if "type" in origins else "",
        )

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
        self._apply(topic_id)
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

    def _configure(self, table: PolicyTable) -> None:
        self._table = table
        for topic in self._link.own_topics:
            self._apply(topic.id)
        self._link.set_table(table)

    def _apply(self, topic_id: int) -> None:
        """Put the policy by the table and the topic's producers in force, as changed since."""
        topic, offer = self._link.topic(topic_id), self._offers.get(topic_id)
        offered = DEFAULT_POLICY if offer is None else offer.policy
        changed = self.changed.get(topic_id, {})
        policy, command = (
            msgspec.structs.replace(
                self._table.made(_name(topic), topic.type, offered, is_command=is_command),
                **changed,
            )
            for is_command in (False, True)
        )
        origins = self._table.origins(_name(topic), topic.type, offered)
        origin = "set" if changed else next(iter(origins), "default")
        self._link.set_policy(topic_id, policy, command, origin)


def _name(topic: Topic) -> str:
    """The name of a topic at the robot whose topic it is."""
    return read_origin(topic.name).name


def _told(value: object) -> object:
    """A value as JSON can express it, which has no infinity."""
    return "inf" if value == float("inf") else value
