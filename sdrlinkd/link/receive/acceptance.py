"""Decides whether a complete message is handed over, by its topic's policy."""

from math import inf

from sdrlinkd.link.queue import (
    DEFAULT_POLICY,
    Inflated,
    PolicyTable,
    TopicPolicy,
    most_expanded,
)
from sdrlinkd.link.receive.delivered import CDR_HEADER_SIZE, Retain
from sdrlinkd.link.topics import HeardTopic
from sdrlinkd.wire import Registry

RETAINED_KEYS = 8
"""Producer keys of a topic of the registry for which a receiver keeps messages."""
_DEFAULTS = DEFAULT_POLICY, DEFAULT_POLICY


class Acceptance:
    """The topics' policies at the receiver.

    A compressed message may expand to its topic's `max_bytes`, or by default to `max_expanded`.
    `takes_all`: messages of robots that are not proven are handed over, whatever their topic.
    Without a seal (`is_sealed`), frames have a largest ratio.
    """

    def __init__(
        self, registry: Registry, inflated: Inflated, max_expanded: int, takes_all: bool,
        is_sealed: bool,
    ) -> None:  # fmt: skip
        self._takes_all = takes_all
        self._is_sealed = is_sealed
        self._has_control = registry.has_control
        self._inflated = inflated
        self._max_expanded = max_expanded
        self._policies: dict[int, tuple[TopicPolicy, TopicPolicy]] = {}
        """Of the registry's topics, and of their messages to one robot."""
        self._table = PolicyTable({})

    def set_policy(
        self, topic_id: int, policy: TopicPolicy, command: TopicPolicy | None = None
    ) -> None:
        """Treat messages of a topic by `policy` from now on.

        `command` is for messages that are sent to one robot; None: the same.
        """
        self._policies[topic_id] = policy, command or policy

    def set_table(self, table: PolicyTable) -> None:
        """Treat messages of declared topics by the policies of `table` from now on."""
        self._table = table

    @property
    def delivers_unproven(self) -> bool:
        """Whether a policy lets messages through from robots that have not proven to be alive."""
        of_registry = any(policy.unproven == "deliver" for policy, _ in self._policies.values())
        return of_registry or self._table.delivers_unproven

    def takes_from(self, topic: HeardTopic, src: int) -> bool:
        """Whether messages of a topic are taken from robot `src`.

        Where it sends them for another robot, they must be allowed from both.
        """
        sources = self.policy_of(topic).from_
        return not sources or {src, topic.origin(src)} <= {*sources}

    def takes_unproven(self, topic: HeardTopic) -> bool:
        """Whether messages of a topic are handed over from robots that are not proven."""
        return self._takes_all or self.policy_of(topic).unproven == "deliver"

    def policy_of(self, topic: HeardTopic | None, *, to_one: bool = False) -> TopicPolicy:
        """The policy of a topic, by default the default policy.

        `to_one`: that of its messages to one robot.
        """
        if topic is None:
            return DEFAULT_POLICY
        if topic.about is not None:
            return self._table.of(topic.at_origin, topic.type, is_command=to_one)
        policy, command = self._policies.get(topic.base, _DEFAULTS)
        return command if to_one else policy

    def commands(self, topic: HeardTopic | None, *, to_one: bool = False) -> bool:
        """Whether messages of a topic are commands, whose absence stops a robot."""
        return topic is not None and self.policy_of(topic, to_one=to_one).deadman_s > 0

    def drops_late(self, topic: HeardTopic, *, to_one: bool = False) -> bool:
        """Whether a message of a topic is dropped if it comes after a newer one.

        Where only the last message of a producer is kept, an older one must not take its place.
        """
        is_last_kept = topic.about is not None and self.retain(topic).depth == 1
        return is_last_kept or self.policy_of(topic, to_one=to_one).drops_late

    def retain(self, topic: HeardTopic) -> Retain:
        """How many messages of a topic are kept for consumers that come later."""
        policy = self.policy_of(topic)
        if topic.about is not None:
            return Retain(max(topic.about.depth, policy.latched), policy.own_lifespan_s)
        # The registry has no numbers for producers: their messages are kept together.
        return Retain(RETAINED_KEYS * policy.latched, policy.own_lifespan_s)

    def judge(
        self,
        topic: HeardTopic,
        payload: bytes,
        is_compressed: bool,
        origin_at: float | None,
        took_s: float,
        now: float,
        *,
        to_one: bool = False,
    ) -> tuple[bytes, str | None]:
        """(the message as submitted, the ledger's reason for dropping it or None).

        `origin_at` is when the message was submitted, None if no STAMP came. It was `took_s` on
        the air, which do not count unless it is a command. `to_one`: it was sent to one robot.
        """
        policy, reason = self.policy_of(topic, to_one=to_one), None
        if is_compressed:
            most = policy.max_bytes or self._max_expanded
            if not policy.max_bytes and not self._is_sealed:
                most = min(most, most_expanded(len(payload)))
            payload, reason = self._inflated.expand(payload, most)
        if reason is None:
            began_at = now - took_s * (not policy.is_command)
            reason = _refusal(payload, policy, origin_at, began_at)
        # Without a control channel there are no STAMPs, so the age is never known.
        if reason == "rx_no_age" and not self._has_control:
            reason = None
        return payload, reason


def _refusal(
    payload: bytes, policy: TopicPolicy, origin_at: float | None, began_at: float
) -> str | None:
    """The ledger's reason for not handing over a complete message; None: it is handed over.

    Its lifespan must not have ended by `began_at`.
    """
    if len(payload) < CDR_HEADER_SIZE:
        return "rx_bad_cdr"
    if policy.max_bytes and len(payload) > policy.max_bytes:
        return "rx_size_cap"
    if policy.own_lifespan_s < inf:
        if origin_at is None:
            return "rx_no_age" if policy.stamp else None
        if began_at - origin_at > policy.own_lifespan_s:
            return "rx_expired"
    return None
