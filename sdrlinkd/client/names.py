"""Names of messages that all robots that hear them share (bus document, section 3.4)."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

PDU_NUMBERS = 1 << 32
SEQUENCE_NUMBERS = 256


@dataclass(frozen=True, slots=True)
class MessageName:
    """Tells a message from others of its source, topic and series.

    `boot_id` is None until the source has told it. `entry_id` is that on the air, or for a large
    message 256 plus its message number. `first_pdu` is the number of the first PDU from which the
    receiver took something of the message, and `more_pdus` how far the last one is behind.
    `is_numbered`: not only the lowest octet of `first_pdu` is known.
    """

    boot_id: int | None
    entry_id: int
    first_pdu: int
    more_pdus: int = 0
    is_numbered: bool = True

    def matches(self, other: "MessageName") -> bool:
        """Whether two receptions within 2 s, of one source, topic and series, are one message."""
        if self.entry_id != other.entry_id:
            return False
        if None not in (self.boot_id, other.boot_id) and self.boot_id != other.boot_id:
            return False
        is_exact = self.is_numbered and other.is_numbered
        modulus = PDU_NUMBERS if is_exact else SEQUENCE_NUMBERS
        ahead = (other.first_pdu - self.first_pdu) % modulus
        behind = (self.first_pdu - other.first_pdu) % modulus
        return ahead <= self.more_pdus or behind <= other.more_pdus


def name_in(fields: Mapping[str, Any]) -> MessageName | None:
    """The name in the header of a message to consumers; None if it has none."""
    entry_id, number = fields.get("e"), fields.get("pn")
    first_pdu = fields.get("sq") if number is None else number
    if entry_id is None or first_pdu is None:
        return None
    return MessageName(
        boot_id=fields.get("b"),
        entry_id=entry_id,
        first_pdu=first_pdu,
        more_pdus=fields.get("ps", 0),
        is_numbered=number is not None,
    )
