"""A complete message from the air."""

from math import inf
from typing import NamedTuple

from sdrlinkd.link.receive.latency import Parts
from sdrlinkd.link.topics import HeardTopic

CDR_HEADER_SIZE = 4
DELIVERED = "delivered"
"""Outcome of a delivered message, in place of a ledger's reason."""

UNNAMED = HeardTopic(0, "", "")


class Retain(NamedTuple):
    """How many messages of a topic from one source are kept for later consumers, and until which
    age in s.
    """

    depth: int
    lifespan_s: float


NOT_RETAINED = Retain(0, inf)


class MessageName(NamedTuple):
    """Tells a message from all others of its source and topic, alike at all robots that hear it.

    `boot_id` is None until the source has told it. `entry_id` is that on the air, or for a large
    message 256 plus its message number. `first_pdu` is the number of the first PDU from which this
    robot took something of the message (of the last part of a large one), and `more_pdus` how far
    the last such PDU is behind. Only the lowest octet of `first_pdu` counts until the source has
    told its PDU numbers (`is_numbered`). The bus document says when two names match (3.4).
    """

    boot_id: int | None
    entry_id: int
    first_pdu: int
    more_pdus: int
    is_numbered: bool


UNNAMED_MESSAGE = MessageName(None, 0, 0, 0, is_numbered=False)


class Delivered(NamedTuple):
    """A complete message from the air.

    `number` counts messages per (source, topic) from 1. `lost_pdus` is the number of the source's
    PDUs known to be lost so far. `origin_at` is when the message was submitted, on the receiver's
    clock, and None if no STAMP came; the age at any time is that time minus `origin_at`.
    `began_at` is the preamble of the burst with the first fragment, `heard_at` that of the burst
    with the last one, and `ended_at` the last fragment's last sample. Messages of several producers
    of a declared topic differ in `series`, the topic's number on the air. `topic` has the name and
    the type of the topic.
    """

    src: int
    topic_id: int
    payload: bytes
    number: int
    lost_pdus: int
    origin_at: float | None
    heard_at: float
    hops_left: int
    snr_db: float | None
    began_at: float = 0.0
    ended_at: float = 0.0
    series: int = 0
    topic: HeardTopic = UNNAMED
    name: MessageName = UNNAMED_MESSAGE
    to_one: bool = False
    """Whether it was sent to one robot."""
    is_sealed: bool = False
    """Whether all of it came sealed."""

    def parts(self, now: float) -> Parts:
        """The parts of the message's age at `now`; without a STAMP the wait counts as 0."""
        origin_at = self.began_at if self.origin_at is None else self.origin_at
        return Parts(
            self.began_at - origin_at,
            self.heard_at - self.began_at,
            self.ended_at - self.heard_at,
            now - self.ended_at,
        )
