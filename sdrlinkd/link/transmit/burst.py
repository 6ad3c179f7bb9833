"""What leaves together, and what became of it."""

from enum import Enum
from typing import NamedTuple

from sdrlinkd.link.qos import Qos
from sdrlinkd.link.queue import Outgoing


class Burst(NamedTuple):
    """PDUs that leave together, and the messages each carries an entry of.

    They leave at `start`, in s on the link's clock; at the latest at `latest`, or not at all.
    """

    pdus: list[bytes]
    carried: list[list[Outgoing]]
    classes: list[Qos]
    """Of each PDU, the highest inside."""
    mcs: int = 0
    qos: Qos = Qos.DEFAULT
    start: float = 0.0
    latest: float = float("inf")
    airtime_s: float = 0.0
    number: int = 0
    """In the order in which they were composed."""
    first_start: float = 0.0
    """Where it was to leave at first; later than that when it came too late."""
    n_records: int = 0
    """PDUs with nothing but a beacon's, CLOCK and RECEIPT records."""
    ready_at: float = 0.0
    """From when on the radio could have taken it."""
    clock: int | None = None
    """Number of the CLOCK record inside, if any."""


class Outcome(Enum):
    """What the radio says of a burst after its last sample."""

    SENT = "sent"
    LATE = "late"
    UNDERFLOW = "underflow"
    LOST = "lost"
