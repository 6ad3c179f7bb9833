"""Which longer messages PDUs hold parts of: those that came, and so those that were lost."""

from collections.abc import Sequence

from sdrlinkd.link.receive import PduPlaced
from sdrlinkd.wire import CONTROL_TOPIC_ID, Entry, Parity

Message = tuple[int, int]
"""(topic id, entry id)."""


def parts(event: PduPlaced) -> dict[Message, list[Entry | Parity]]:
    """The fragments and the parity of longer messages in a PDU, in the order of the messages."""
    found: dict[Message, list[Entry | Parity]] = {}
    for entry in event.read.pdu.entries:
        if entry.total > 1 and entry.topic_id != CONTROL_TOPIC_ID:
            found.setdefault((entry.topic_id, entry.entry_id), []).append(entry)
    for record in event.read.records:
        if isinstance(record, Parity):
            found.setdefault((record.topic_id, record.entry_id), []).append(record)
    return found


def inside(before: PduPlaced, event: PduPlaced) -> frozenset[Message]:
    """The messages of which all PDUs lost between two others held parts.

    Another message may have gone in between: then parts are missing in fewer PDUs than were lost.
    """
    n_lost = event.number - before.number - 1
    earlier, later = parts(before), parts(event)
    return frozenset(
        message
        for message, pieces in later.items()
        if message in earlier and _n_pdus_between(earlier[message][-1], pieces) >= n_lost
    )


def _n_pdus_between(last: Entry | Parity, pieces: Sequence[Entry | Parity]) -> int:
    """The least number of PDUs with parts of a message after `last` and before `pieces`.

    Parity is ordered by position in the fragments, then by number (wire document, section 6.5).
    """
    first = pieces[0]
    if isinstance(first, Entry):
        return first.index - last.index - 1 if isinstance(last, Entry) else 0
    if isinstance(last, Entry):
        n_fragments = last.total - 1 - last.index
        n_records = first.number + first.n_parity * (first.at > 0)
    else:
        n_fragments = 0
        rows = (first.at - last.at) // max(1, len(last.data))
        n_records = first.number - last.number - 1 + first.n_parity * rows
    return n_fragments + -(-n_records // len(pieces))
