"""What a producer says of its topic's QoS, and the policy that follows where none is configured."""

import re
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from sdrlinkd.errors import DeclarationError
from sdrlinkd.link import DEFAULT_POLICY, Offer, TopicPolicy
from sdrlinkd.wire import HASH_SIZE

BEST_EFFORT = TopicPolicy(depth=1, lifespan_s=0.5)
RELIABLE = TopicPolicy(depth=10, lifespan_s=5.0)
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
    depth: Annotated[int, Meta(ge=0, le=255)] = 1
    """Messages of each producer that late joiners get, with transient_local."""

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
            return TopicPolicy(durability="transient_local", depth=max(1, self.depth))
        return RELIABLE if self.reliability == "reliable" else BEST_EFFORT

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
            max(1, self.depth) if self.is_latched else 0,
            self.reliability == "best_effort",
        )


def merged(configured: TopicPolicy, offered: TopicPolicy) -> TopicPolicy:
    """The configured policy, with the keys that have their default value as offered."""
    if not configured.offer:
        return configured
    left = {
        key: getattr(offered, key)
        for key in TopicPolicy.__struct_fields__
        if getattr(configured, key) == getattr(DEFAULT_POLICY, key)
    }
    return msgspec.structs.replace(configured, **left)
