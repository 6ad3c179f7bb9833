"""Which policy a topic gets: its own, else that of its message type, else what is offered."""

from collections.abc import Mapping
from typing import Any

import msgspec

from sdrlinkd.link.queue.policy import DEFAULT_POLICY, TopicPolicy

MOST_KNOWN = 1000
"""Most policies that are remembered, as names and types come from the air."""


class TypePolicies(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Policies by message type, as `pkg/msg/Name`.

    Those of `command` are for messages that are sent to one robot, on top of those of `type`; those
    of `name` are for topics whose name ends like this.
    """

    type: dict[str, TopicPolicy] = {}
    command: dict[str, TopicPolicy] = {}
    name: dict[str, TopicPolicy] = {}


NO_TYPES = TypePolicies()


class PolicyTable:
    """The policies of all topics, by name and message type, at senders and receivers alike.

    `configured` are the policies by topic name without leading slash. Each key of a policy comes
    from the first of these that gives it: the configured policy, that of the type, the producer's
    offer.
    """

    def __init__(
        self, configured: Mapping[str, TopicPolicy], by_type: TypePolicies = NO_TYPES
    ) -> None:
        self._configured = configured
        self._by_type = by_type
        self._known: dict[tuple[str, str, bool], TopicPolicy] = {}

    @property
    def delivers_unproven(self) -> bool:
        """Whether a configured policy lets messages through from robots that are not proven."""
        return any(policy.unproven == "deliver" for policy in self._configured.values())

    def configured(self, name: str) -> TopicPolicy:
        """The configured policy of a topic, by default the default policy."""
        return self._configured.get(name, DEFAULT_POLICY)

    def of(self, name: str, kind: str, *, is_command: bool = False) -> TopicPolicy:
        """The policy of messages of topic `name` and type `kind` without an offer.

        `is_command`: they are sent to one robot.
        """
        key = name, kind, is_command
        policy = self._known.get(key)
        if policy is None:
            if len(self._known) >= MOST_KNOWN:
                self._known.clear()
            policy = self._known[key] = self.made(name, kind, is_command=is_command)
        return policy

    def made(
        self, name: str, kind: str, offered: TopicPolicy = DEFAULT_POLICY, *,
        is_command: bool = False,
    ) -> TopicPolicy:  # fmt: skip
        """The policy of a topic whose producer offers what `offered` gives."""
        configured = self.configured(name)
        if not configured.offer:
            return configured
        by_type = self._of_type(name, kind, is_command=is_command)
        return TopicPolicy(**{**offered.given, **by_type, **configured.given})

    def origins(self, name: str, kind: str, offered: TopicPolicy) -> list[str]:
        """Where the keys of a topic's policy come from, as far as any does: file, type, offer."""
        configured = self.configured(name)
        origins, known = [], set[str]()
        for origin, given in (
            ("file", configured.given),
            ("type", self._of_type(name, kind)),
            ("offer", offered.given),
        ):
            if given.keys() - known and (configured.offer or origin == "file"):
                origins.append(origin)
            known |= given.keys()
        return origins

    def _of_type(self, name: str, kind: str, *, is_command: bool = False) -> dict[str, Any]:
        """What the type of a topic gives."""
        table = self._by_type
        found: dict[str, Any] = {}
        for policies, key, applies in (
            (table.type, kind, True),
            (table.command, kind, is_command),
            (table.name, name.rpartition("/")[2], True),
        ):
            if applies and key in policies:
                found |= policies[key].given
        return found
