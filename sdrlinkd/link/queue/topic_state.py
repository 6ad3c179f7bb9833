"""The sender's state of a topic: its policy, resolved once, and its counters."""

import zstandard

from sdrlinkd.link.qos import QOS_BY_LABEL
from sdrlinkd.link.queue.admission import Admission
from sdrlinkd.link.queue.compression import Deflated
from sdrlinkd.link.queue.ledger import TxTally
from sdrlinkd.link.queue.policy import TopicPolicy


class TopicState:
    """The sender's state of one topic."""

    __slots__ = (
        "_default_dst", "_dictionary", "_has_control", "_n_large", "admission", "deflated", "dst",
        "policy", "priority", "qos", "stamp", "tally",
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
        self.apply(TopicPolicy())

    def count_large(self) -> int:
        """Count one large message; returns its number modulo 2^16."""
        self._n_large = (self._n_large + 1) & 0xFFFF
        return self._n_large

    def apply(self, policy: TopicPolicy) -> None:
        """Apply `policy` to messages from now on; messages in the queue keep their settings."""
        self.policy = policy
        self.qos = QOS_BY_LABEL[policy.qos]
        self.priority = policy.priority
        self.dst = self._default_dst if policy.dst is None else policy.dst
        self.stamp = policy.stamp and self._has_control
        self.admission = Admission(policy)
        self.deflated = Deflated(self._dictionary) if policy.compress == "zstd" else None
