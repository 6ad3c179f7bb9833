"""Names of messages that all robots that hear them share (bus document, section 3.4)."""

from sdrlinkd.link.receive.delivered import MessageName
from sdrlinkd.link.receive.neighbors import Neighbor
from sdrlinkd.wire import PDU_NUMBERS

LARGE = 256
"""Added to the message number of a large message, to tell it from an entry id."""


def name_of(source: Neighbor, entry_id: int, pdus: tuple[int, int]) -> MessageName:
    """The name of a message from `source`, parts of which were in PDUs `pdus`, first to last.

    `entry_id` of a large message is LARGE plus its message number.
    """
    first, last = pdus
    is_numbered = source.track.is_numbered
    # The name of a message that began before its source told PDU numbers still has the last one.
    span = PDU_NUMBERS if is_numbered else LARGE
    return MessageName(source.boot_id, entry_id, first % span, last - first, is_numbered)
