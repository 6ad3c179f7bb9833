"""Piggyback records: control records that use spare room in PDUs."""

from collections.abc import Iterable
from math import inf
from typing import NamedTuple

from sdrlinkd.wire import (
    MAX_SINCE,
    RECEIPT_UNIT_S,
    PduBuilder,
    Receipt,
    Record,
    RecordType,
    TopicPiece,
    Wanted,
    build_records,
)

LASTING = frozenset(
    {
        RecordType.CLOCK, RecordType.RECEIPT, RecordType.TOPIC, RecordType.WANTED,
        RecordType.CONTACT,
    }
)  # fmt: skip
"""Record types that a new beacon does not replace."""


class _Waiting(NamedTuple):
    built: bytes
    due_at: float
    receipt: Receipt | None = None
    since: float = 0.0
    """Time of the event that the receipt reports."""


class PiggybackRecords:
    """Records that wait for a PDU with room; each has a time from which it gets its own PDU."""

    def __init__(self) -> None:
        self.waiting: dict[tuple[int, ...], _Waiting] = {}
        """Waiting records by type, and by what distinguishes two records of one type."""
        self.due_at = inf
        """Earliest time at which a record gets its own PDU; infinity: no record waits."""

    def holds(self, kind: RecordType) -> bool:
        """Whether a record of type `kind` waits."""
        return any(key[0] == kind for key in self.waiting)

    def is_overdue(self, kind: RecordType, now: float) -> bool:
        """Whether a record of type `kind` should have a PDU of its own at `now`."""
        return any(key[0] == kind and each.due_at <= now for key, each in self.waiting.items())

    def count(self, kind: RecordType) -> int:
        """How many records of type `kind` wait."""
        return sum(key[0] == kind for key in self.waiting)

    def offer(self, records: Iterable[Record], due_at: float = -inf) -> None:
        """Add a beacon's records, which replace those of the last beacon."""
        kept = {key: each for key, each in self.waiting.items() if key[0] in LASTING}
        built = (build_records([record]) for record in records)
        # The two octets after the header distinguish records of one type.
        self.waiting = {(*each[:1], *each[2:4]): _Waiting(each, due_at) for each in built}
        self.waiting |= kept
        self._note_due()

    def put(self, record: Record, due_at: float) -> None:
        """Add a record; it replaces one of its type, and then keeps that one's due time."""
        built = build_records([record])
        known = self.waiting.get((built[0],))
        self.waiting[built[0],] = _Waiting(built, due_at if known is None else known.due_at)
        self._note_due()

    def put_receipt(self, receipt: Receipt, due_at: float, since: float) -> None:
        """Add a RECEIPT that reports an event at `since`."""
        built = build_records([receipt])
        key = (built[0], receipt.node, receipt.topic_id, receipt.entry_id)
        self.waiting[key] = _Waiting(built, due_at, receipt, since)
        self._note_due()

    def put_topic(self, piece: TopicPiece) -> None:
        """Add a piece of a topic's description, for spare room; see `make_due`."""
        built = build_records([piece])
        key = (built[0], piece.number, piece.piece)
        due_at = self.waiting[key].due_at if key in self.waiting else inf
        self.waiting[key] = _Waiting(built, due_at)

    def put_wanted(self, wanted: Wanted, due_at: float) -> None:
        """Add a WANTED record; it replaces one that still waits, and keeps that one's due time."""
        built = build_records([wanted])
        key = (built[0], wanted.node, *wanted.topics[:1])
        known = self.waiting.get(key)
        self.waiting[key] = _Waiting(built, due_at if known is None else known.due_at)
        self._note_due()

    def make_due(self, kind: RecordType, room: int, now: float) -> None:
        """Let waiting records of a type, of `room` octets together, get their own PDU from now."""
        for key, each in self.waiting.items():
            if key[0] == kind and each.due_at == inf:
                room -= len(each.built)
                if room < 0:
                    break
                self.waiting[key] = each._replace(due_at=now)
        self._note_due()

    def renew(self, record: Record) -> None:
        """Replace a waiting record of the same type with `record`; do nothing if none waits."""
        built = build_records([record])
        for key, each in self.waiting.items():
            if key[0] == built[0]:
                self.waiting[key] = each._replace(built=built)

    def ride(self, pdu: PduBuilder, start: float) -> None:
        """Move as many records as fit into `pdu`, whose burst leaves at `start`.

        Receipts older than their field can express are dropped: they could be mistaken for those of
        another message.
        """
        oldest = start - MAX_SINCE * RECEIPT_UNIT_S
        for key in [
            key for key, each in self.waiting.items() if each.receipt and each.since < oldest
        ]:
            del self.waiting[key]
        rides = [key for key, each in self.waiting.items() if pdu.add_record(_as_of(each, start))]
        for key in rides:
            del self.waiting[key]
        self._note_due()

    def _note_due(self) -> None:
        self.due_at = min((each.due_at for each in self.waiting.values()), default=inf)


def _as_of(waiting: _Waiting, start: float) -> bytes:
    if waiting.receipt is None:
        return waiting.built
    since = min(max(round((start - waiting.since) / RECEIPT_UNIT_S), 0), MAX_SINCE)
    return build_records([waiting.receipt._replace(since_100us=since)])
