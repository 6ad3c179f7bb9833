"""The policy of a topic, at the sender and at the receiver."""

from collections.abc import Collection, Mapping
from math import inf
from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta

from sdrlinkd.link.qos import MAX_PRIORITY, MIDDLE_PRIORITY

MOST_LATCHED = 64
"""Most messages that `keep_all` keeps for late joiners."""
Positive = Annotated[float, Meta(gt=0)]
Amount = Annotated[int, Meta(ge=0, le=1_000_000)]
Octets = Annotated[int, Meta(ge=0, le=1 << 40)]


class TopicPolicy(
    msgspec.Struct,
    frozen=True,
    kw_only=True,
    forbid_unknown_fields=True,
    dict=True,
    rename={"from_": "from"},
):
    """Policy of one topic; a producer may override class, priority, lifespan and destination."""

    qos: Literal["urgent", "latency", "default", "bulk"] = "default"
    """Class of the messages, unless the producer names one."""
    priority: Annotated[int, Meta(ge=0, le=MAX_PRIORITY)] = MIDDLE_PRIORITY
    """Priority within the class, 0 to 127; 127 is the most urgent."""
    weight: Annotated[float, Meta(ge=0.01, le=100)] = 1.0
    """Share of the airtime that the topic gets, in proportion to those of other topics of equal
    class and priority that have something to send at the same time."""
    history: Literal["keep_last", "keep_all"] = "keep_last"
    """Queue history: keep_last keeps the last `depth` messages, keep_all ignores `depth`."""
    depth: Amount = 0
    """Most messages of a producer key to one destination that wait in the queue, where newer ones
    replace older ones; 0: no limit but the queue's."""
    key: Literal["producer", "child_frames"] = "producer"
    """Key of messages whose producer gives none: producer: they have the same one; child_frames:
    the child frames of a tf2_msgs/TFMessage, so that `depth` holds for each."""
    lifespan_s: Positive | None = None
    """Age in s after which a message is neither sent nor handed over. If absent, the lifespan of
    its class applies, at the sender only."""
    deadman_s: Annotated[float, Meta(ge=0, le=60)] = 0.0
    """At the receiver: time in s without a message after which `stop` is published, once; 0:
    never."""
    stop: dict[str, Any] = {}
    """Fields of the stop message; fields not named are zero, so that {} is a zero Twist."""
    durability: Literal["volatile", "transient_local"] = "volatile"
    """transient_local: late joiners get the last `depth` messages (at least one) of each producer
    key; volatile: they do not."""
    offer: bool = True
    """Whether keys that are absent here come from the topic's message type, and from the QoS that
    its producer declares; false: they have the default values of this list."""
    dst: Annotated[int, Meta(ge=0, le=255)] | None = None
    """Destination robot; absent: `link.dst`."""
    from_: list[Annotated[int, Meta(ge=0, le=254)]] = []
    """At the receiver: robots whose messages are taken; none listed: those of all robots."""
    unproven: Literal["drop", "deliver"] = "drop"
    """At a receiver with keys: what happens to messages of robots that have not proven yet that
    they are alive now, so that these may be recordings."""
    late: Literal["deliver", "drop"] = "deliver"
    """At the receiver: what happens to a message that comes after a newer one of its source, as a
    PDU was sent again; drop: always for a topic with `deadman_s`."""
    stamp: bool = True
    """Whether to send each message's age, so that the receiver knows how late it is."""
    period_s: Annotated[float, Meta(ge=0, le=3600)] = 0.0
    """Shortest time in s between two messages sent; 0: no throttle."""
    reserve: bool = False
    """Whether to reserve the team's air for a message of `max_bytes` every `period_s`, which are
    both needed. While the team has no air for it, the topic's messages are dropped."""
    decimate: Annotated[int, Meta(ge=1, le=1_000_000)] = 1
    """Send one message in this many."""
    on_change: bool = False
    """Whether to send only messages that differ from the last one."""
    max_bytes: Octets = 0
    """Size in bytes above which messages are refused, sent or heard; 0: no limit but the link's."""
    compress: Literal["none", "zstd"] = "none"
    """Compression; a message that zstd does not shrink is sent uncompressed."""
    dictionary: str = ""
    """File with a zstd dictionary for small messages, relative to the configuration; the same at
    all robots."""
    queue_bytes: Octets = 0
    """Most bytes that wait in the queue, beyond which the oldest messages are dropped; 0: no limit
    but the queue's."""
    queue_s: Annotated[float, Meta(ge=0)] = 0.0
    """Most airtime in s that waits in the queue, beyond which the oldest messages are dropped; 0:
    no limit."""

    def given_in(self, keys: Collection[str]) -> "TopicPolicy":
        """This policy, of which a file gives `keys`, with their default values or others."""
        fields = {field.encode_name: field.name for field in msgspec.structs.fields(self)}
        named = msgspec.structs.replace(self)
        msgspec.structs.force_setattr(named, "_given", tuple(fields[key] for key in keys))
        return named

    @property
    def given(self) -> Mapping[str, Any]:
        """Fields that were given, with their values; unless told, those without default value."""
        named: Collection[str] | None = self.__dict__.get("_given")
        if named is None:
            named = [
                field for field in self.__struct_fields__
                if getattr(self, field) != getattr(DEFAULT_POLICY, field)
            ]  # fmt: skip
        return {field: getattr(self, field) for field in named}

    @property
    def kept(self) -> int:
        """Most messages that wait in the queue; 0: no limit but the queue's."""
        return self.depth if self.history == "keep_last" else 0

    @property
    def is_command(self) -> bool:
        """Whether its messages are commands, whose lifespan ends even if they have begun."""
        return self.qos == "urgent" or self.deadman_s > 0

    @property
    def drops_late(self) -> bool:
        """Whether a message that comes after a newer one of its source is dropped."""
        return self.late == "drop" or self.deadman_s > 0

    @property
    def latched(self) -> int:
        """Most messages of a producer key that are kept for late joiners; 0: none."""
        if self.durability == "volatile":
            return 0
        return max(1, self.depth) if self.history == "keep_last" else MOST_LATCHED

    @property
    def own_lifespan_s(self) -> float:
        """The topic's own lifespan in s; infinity if it has none."""
        return inf if self.lifespan_s is None else self.lifespan_s


DEFAULT_POLICY = TopicPolicy()
