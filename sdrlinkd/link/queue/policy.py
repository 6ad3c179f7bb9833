"""How a topic's messages are treated, on their way out and where they arrive."""

from math import inf
from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta

from sdrlinkd.link.qos import MAX_PRIORITY

Positive = Annotated[float, Meta(gt=0)]
Amount = Annotated[int, Meta(ge=0)]


class TopicPolicy(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Policy of one topic; a producer may override class, priority, lifespan and destination."""

    qos: Literal["urgent", "latency", "default", "bulk"] = "default"
    priority: Annotated[int, Meta(ge=0, le=MAX_PRIORITY)] = 64
    """127 is the most urgent."""
    history: Literal["keep_last", "keep_all"] = "keep_last"
    """keep_all: `depth` does not count."""
    depth: Amount = 0
    """Messages that may wait, latest wins; 0: as many as the queue holds."""
    lifespan_s: Positive | None = None
    """Seconds after which a message is worthless: neither sent nor handed over any more; absent:
    not sent after that of its class."""
    deadman_s: Annotated[float, Meta(ge=0, le=60)] = 0.0
    """Where it arrives: without a message handed over for so long, `stop` is, once; 0: never."""
    stop: dict[str, Any] = {}
    """Fields of that message; those that are not named are zero, so that {} is a zero Twist."""
    durability: Literal["volatile", "transient_local"] = "volatile"
    """transient_local: robots that come late get the last message."""
    dst: Annotated[int, Meta(ge=0, le=255)] | None = None
    """Destination robot; absent: `link.dst`."""
    stamp: bool = True
    """Send the age along, so that the far end knows how late each message is."""
    period_s: Annotated[float, Meta(ge=0, le=3600)] = 0.0
    """Send no more often than this; 0: as often as they come."""
    decimate: Annotated[int, Meta(ge=1)] = 1
    """Send one in so many."""
    on_change: bool = False
    """Send only what differs from the last one."""
    max_bytes: Amount = 0
    """Refuse larger messages, sent or heard; 0: whatever fits the link."""
    compress: Literal["none", "zstd"] = "none"
    """A message that does not shrink goes as it is."""
    dictionary: str = ""
    """zstd dictionary for small messages, relative to the configuration; the same at all robots."""
    queue_bytes: Amount = 0
    """Bytes that may wait; more, and the oldest goes; 0: as many as the queue holds."""
    queue_s: Annotated[float, Meta(ge=0)] = 0.0
    """Seconds on the air of what may wait; more, and the oldest goes; 0: no bound."""

    @property
    def kept(self) -> int:
        """Messages that may wait; 0: as many as the queue holds."""
        return self.depth if self.history == "keep_last" else 0

    @property
    def own_lifespan_s(self) -> float:
        """That of the topic itself; inf where it has none."""
        return inf if self.lifespan_s is None else self.lifespan_s


DEFAULT_POLICY = TopicPolicy()
