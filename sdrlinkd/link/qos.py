"""How a message is to be treated: its class, priority, lifespan and depth."""

from enum import IntEnum
from typing import Annotated, Literal, NamedTuple

import msgspec
from msgspec import Meta

INFINITE = float("inf")


class Qos(IntEnum):
    """Traffic class; the smaller number goes first."""

    URGENT = 0
    LATENCY = 1
    DEFAULT = 2
    BULK = 3

    @property
    def label(self) -> str:
        """The name on the bus, in the configuration and on the screen."""
        return self.name.lower()


# The two Q bits of the header (wire document, section 3.1), by class.
WIRE_BITS = {Qos.DEFAULT: 0, Qos.LATENCY: 1, Qos.BULK: 2, Qos.URGENT: 3}
CLASSES = {bits: qos for qos, bits in WIRE_BITS.items()}
QOS_BY_LABEL = {qos.label: qos for qos in Qos}

MAX_PRIORITY = 127


class Overrides(NamedTuple):
    """What a producer asks of one message; None leaves it to the topic's policy."""

    qos: Qos | None = None
    priority: int | None = None
    dst: int | None = None
    lifespan_s: float | None = None


AS_CONFIGURED = Overrides()


class TopicPolicy(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Policy of one topic; a producer may override class, priority, lifespan and destination."""

    qos: Literal["urgent", "latency", "default", "bulk"] = "default"
    priority: Annotated[int, Meta(ge=0, le=MAX_PRIORITY)] = 64
    """127 is the most urgent."""
    depth: Annotated[int, Meta(ge=0)] = 0
    """Messages that may wait, latest wins; 0: as many as the queue holds."""
    lifespan_s: Annotated[float, Meta(gt=0)] = INFINITE
    """Seconds after which an unsent message is worthless."""
    dst: Annotated[int, Meta(ge=0, le=255)] | None = None
    """Destination robot; absent: `link.dst`."""
    stamp: bool = True
    """Send the age along, so that the far end knows how late each message is."""
