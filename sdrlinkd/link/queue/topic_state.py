"""The sender's state of a topic: its policy, resolved once, and its counters."""

from math import inf

import zstandard

from sdrlinkd.link.qos import QOS_BY_LABEL, Qos
from sdrlinkd.link.queue.admission import Admission
from sdrlinkd.link.queue.compression import Deflated
from sdrlinkd.link.queue.ledger import TxTally
from sdrlinkd.link.queue.policy import TopicPolicy
from sdrlinkd.wire import BROADCAST


class TopicState:
    """The sender's state of one topic."""

    __slots__ = (
        "_default_dst", "_dictionary", "_has_control", "_n_large", "admission", "command",
        "deflated", "dst", "needed_bytes_per_s", "origin", "policy", "tally", "used_at",
    )  # fmt: skip

    def __init__(
        self,
        dst: int,
        has_control: bool,
        dictionary: zstandard.ZstdCompressionDict | None,
        first_large: int = 0,
    ) -> None:
        self._default_dst = dst
        self._has_control = has_control
        self._dictionary = dictionary
        self._n_large = first_large
        self.tally = TxTally()
        self.origin = ""
        self.needed_bytes_per_s = 0.0
        self.used_at = -inf
        """When a producer declared the topic, or sent a message of it, for the last time."""
        self.apply(TopicPolicy())

    def count_large(self) -> int:
        """Count one large message; returns its number modulo 2^16."""
        self._n_large = (self._n_large + 1) & 0xFFFF
        return self._n_large

    def apply(self, policy: TopicPolicy, command: TopicPolicy | None = None) -> None:
        """Apply `policy` to messages from now on; messages in the queue keep their settings.

        `command` is for messages that are sent to one robot; None: the same.
        """
        self.policy = policy
        self.command = command or policy
        self.dst = self._default_dst if policy.dst is None else policy.dst
        self.admission = Admission(policy)
        self.deflated = Deflated(self._dictionary) if policy.compress == "zstd" else None

    def policy_to(self, dst: int) -> TopicPolicy:
        """The policy of messages to robot `dst`."""
        return self.policy if dst == BROADCAST else self.command

    def stamps(self, policy: TopicPolicy) -> bool:
        """Whether the age of messages goes with them."""
        return policy.stamp and self._has_control

    @property
    def qos(self) -> Qos:
        """Class of messages to the default destination."""
        return QOS_BY_LABEL[self.policy_to(self.dst).qos]
