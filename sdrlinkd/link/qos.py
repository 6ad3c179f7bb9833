"""Traffic classes, and what a producer may ask of one message."""

from enum import IntEnum
from typing import NamedTuple


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
    age_s: float = 0.0
    """So old it is when it is submitted, by its producer's word."""
    receipt: str = ""
    """The producer's name for it, who wants to know what becomes of it; empty: nobody does."""


AS_CONFIGURED = Overrides()
