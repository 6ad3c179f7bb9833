"""Traffic classes, and the options that a producer may set for a message."""

from enum import IntEnum
from typing import NamedTuple


class Qos(IntEnum):
    """Traffic class; the smaller number is sent first."""

    URGENT = 0
    LATENCY = 1
    DEFAULT = 2
    BULK = 3

    @property
    def label(self) -> str:
        """The class's name on the bus, in the configuration and on the screen."""
        return self.name.lower()


# The two Q bits of the PDU header (wire document, section 3.1), by class.
WIRE_BITS = {Qos.DEFAULT: 0, Qos.LATENCY: 1, Qos.BULK: 2, Qos.URGENT: 3}
CLASSES = {bits: qos for qos, bits in WIRE_BITS.items()}
QOS_BY_LABEL = {qos.label: qos for qos in Qos}

MAX_PRIORITY = 127
MIDDLE_PRIORITY = 64
"""The priority where none is set."""


class Overrides(NamedTuple):
    """A producer's options for one message; None: by the topic's policy."""

    qos: Qos | None = None
    priority: int | None = None
    dst: int | None = None
    lifespan_s: float | None = None
    age_s: float = 0.0
    """Age of the message at its submission in s, as its producer reports."""
    receipt: str = ""
    """The producer's id for the receipt of the message; empty: no receipt wanted."""
    key: str = ""
    """Tells the streams of a topic apart, as those of several publishers."""


AS_CONFIGURED = Overrides()
