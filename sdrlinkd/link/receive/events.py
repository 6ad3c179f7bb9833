"""What receiving comes to: whole messages, and what else a PDU means to the link."""

from typing import NamedTuple

from sdrlinkd.link.receive.delivered import Delivered
from sdrlinkd.wire import Pdu, Record, Stamp


class PduHeard(NamedTuple):
    """A good PDU, for whomever, that is not our own voice; its burst's preamble came at `at`.

    `is_relayed`: another robot than its source has sent it.
    """

    pdu: Pdu
    stamps: list[Stamp]
    at: float
    is_relayed: bool


class RecordHeard(NamedTuple):
    """A control record that receiving itself has no use for came from `src` at `at`."""

    src: int
    record: Record
    at: float


class Newcomer(NamedTuple):
    """A robot was heard for the first time, or has started anew."""

    src: int
    at: float


class Ended(NamedTuple):
    """A message whose sender wants to know has ended: delivered, or dropped for `reason`.

    `age_s` is its age then, None where no STAMP told.
    """

    src: int
    topic_id: int
    entry_id: int
    reason: str
    age_s: float | None
    at: float


class PduToRelay(NamedTuple):
    """A PDU is to be forwarded; all its messages are worthless after `until`.

    `is_ours_too`: it is for this robot, as well as for others.
    """

    pdu: Pdu
    data: bytes
    at: float
    until: float
    is_ours_too: bool


Event = Delivered | PduHeard | RecordHeard | Newcomer | Ended | PduToRelay
