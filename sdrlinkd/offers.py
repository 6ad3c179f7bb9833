"""What a producer says of its topic's QoS, and the policy that follows where none is configured."""

import re
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from sdrlinkd.errors import DeclarationError
from sdrlinkd.link import Offer, TopicPolicy
from sdrlinkd.wire import HASH_SIZE

QUEUE_BYTES = 4 << 20
"""Most bytes of a topic's messages that wait: a quarter of what the queue holds."""
RELIABLE = TopicPolicy(depth=100, lifespan_s=5.0, queue_bytes=QUEUE_BYTES)
BEST_EFFORT = TopicPolicy(depth=5, lifespan_s=0.5, queue_bytes=QUEUE_BYTES)
"""Where the depth is unknown; that of SensorDataQoS."""
MOST_LATCHED = 255
_RIHS01 = re.compile(r"RIHS01_[0-9a-f]{64}")


class Declaration(msgspec.Struct, frozen=True, kw_only=True):
    """The arguments of the verb `declare`; unknown ones are ignored."""

    name: str
    """Name on the bus, as in `/robot_1/odom`."""
    type: str
    """Message type, as in `nav_msgs/msg/Odometry`."""
    hash: str = ""
    """The type's RIHS01 hash; empty: unknown."""
    reliability: Literal["reliable", "best_effort"] = "reliable"
    """Reliability of the producer's QoS."""
    durability: Literal["volatile", "transient_local"] = "volatile"
    """Durability of the producer's QoS."""
    depth: Annotated[int, Meta(ge=0, le=10_000)] = 0
    """Depth of the history of all producers without keys together; 0: unknown. With
    transient_local, so many messages of each producer key are for late joiners, at most 255."""

    @property
    def is_latched(self) -> bool:
        """Whether late joiners get the last messages."""
        return self.durability == "transient_local"

    @property
    def words(self) -> str:
        """The QoS in words."""
        return "transient local" if self.is_latched else self.reliability.replace("_", " ")

    @property
    def policy(self) -> TopicPolicy:
        """The policy for a topic that nobody configured."""
        if self.is_latched:
            return TopicPolicy(durability="transient_local", depth=self._latched)
        offered = RELIABLE if self.reliability == "reliable" else BEST_EFFORT
        return msgspec.structs.replace(offered, depth=self.depth or offered.depth)

    @property
    def _latched(self) -> int:
        """How many messages of each producer late joiners get."""
        return max(1, min(self.depth, MOST_LATCHED)) if self.is_latched else 0

    def joined(self, other: "Declaration") -> "Declaration":
        """The offer of two producers of one topic: the stronger one of each."""
        is_reliable = "reliable" in (self.reliability, other.reliability)
        return msgspec.structs.replace(
            other,
            reliability="reliable" if is_reliable else "best_effort",
            durability=self.durability if self.is_latched else other.durability,
            depth=max(self.depth, other.depth),
            hash=other.hash or self.hash,
        )

    def offer(self, name: str) -> Offer:
        """What the link needs to know of a topic called `name` on the air.

        Raises DeclarationError.
        """
        if self.hash and not _RIHS01.fullmatch(self.hash):
            raise DeclarationError(
                f"hash: got {self.hash[:80]!r}; allowed: RIHS01_ and 64 hex digits, or nothing"
            )
        hash_ = bytes.fromhex(self.hash.removeprefix("RIHS01_"))[:HASH_SIZE]
        return Offer(
            name,
            self.type,
            hash_ or bytes(HASH_SIZE),
            self._latched,
            self.reliability == "best_effort",
        )
