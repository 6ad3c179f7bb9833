"""The states of an outgoing message, and the steps between them."""

from collections.abc import Mapping
from enum import IntEnum, auto


class Fate(IntEnum):
    """State of a message in the ledger."""

    QUEUED = auto()
    IN_FLIGHT = auto()
    SENT = auto()
    DROPPED = auto()


class Step(IntEnum):
    """Events in the life of a message."""

    BEGIN = auto()
    """The first fragment of the message is cut."""
    LEAVE = auto()
    """The radio has sent the whole message."""
    DROP = auto()
    """The message is dropped under one of the ledger's reasons."""


STEPS: Mapping[tuple[Fate, Step], Fate] = {
    (Fate.QUEUED, Step.BEGIN): Fate.IN_FLIGHT,
    (Fate.QUEUED, Step.DROP): Fate.DROPPED,
    (Fate.IN_FLIGHT, Step.LEAVE): Fate.SENT,
    (Fate.IN_FLIGHT, Step.DROP): Fate.DROPPED,
}
"""State machine of a message: the allowed steps and the resulting states. The number of messages
entered is the sum over all states, so this table also defines the ledger."""
