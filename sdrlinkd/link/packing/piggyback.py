"""Piggyback records: control records that use spare room in PDUs."""

from collections.abc import Iterable
from math import inf
from typing import NamedTuple

from sdrlinkd.wire import (
    MAX_SINCE,
    RECEIPT_UNIT_S,
    Beacon,
    Clock,
    Need,
    PduBuilder,
    Receipt,
    Record,
    RecordType,
    TopicPiece,
    build_records,
)

LASTING = frozenset(
    {
        RecordType.CLOCK, RecordType.RECEIPT, RecordType.TOPIC, RecordType.WANTED,
        RecordType.CONTACT, RecordType.NEED, RecordType.ROUTE, RecordType.LSA,
        RecordType.FLOWS, RecordType.ADMIT, RecordType.FOUND, RecordType.RATE,
    }
)  # fmt: skip
"""Record types that a new beacon does not replace."""


class _Waiting(NamedTuple):
    built: bytes
    due_at: float
    record: Receipt | Beacon | Clock | None = None
    """A record that is made when it rides."""
    since: float = 0.0
    """Time of the event that a RECEIPT reports."""

    def as_of(self, start: float, number: int) -> bytes:
        """The record in PDU `number`, whose burst leaves at `start`."""
        record = self.record
        if record is None:
            return self.built
        if isinstance(record, Receipt):
            since = min(max(round((start - self.since) / RECEIPT_UNIT_S), 0), MAX_SINCE)
            return build_records([record._replace(since_100us=since)])
        return build_records([record._replace(pdu_number=number)])


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
        self.waiting = {}
        for record in records:
            built = build_records([record])
            # The two octets after the header distinguish records of one type.
            self.waiting[*built[:1], *built[2:4]] = _Waiting(built, due_at, _made_later(record))
        self.waiting |= kept
        self._note_due()

    def put(self, record: Record, due_at: float) -> None:
        """Add a record; it replaces one of its type, and then keeps that one's due time."""
        built = build_records([record])
        known = self.waiting.get((built[0],))
        due_at = due_at if known is None else known.due_at
        self.waiting[built[0],] = _Waiting(built, due_at, _made_later(record))
        self._note_due()

    def put_as(self, key: tuple[int, ...], record: Record, due_at: float) -> None:
        """Add a record; it replaces the one with this key, and is due when the earlier of both is.

        The type of the record comes first in `key`.
        """
        known = self.waiting.get(key)
        due_at = due_at if known is None else min(due_at, known.due_at)
        self.waiting[key] = _Waiting(build_records([record]), due_at)
        self._note_due()

    def take_back(self, key: tuple[int, ...]) -> bool:
        """Remove a record that has not ridden; returns whether there was one."""
        is_there = self.waiting.pop(key, None) is not None
        self._note_due()
        return is_there

    def put_needs(self, needs: Iterable[Need], due_at: float) -> None:
        """Replace all NEED records that ask for something."""
        for key in [key for key in self.waiting if _asks(key)]:
            del self.waiting[key]
        for need in needs:
            key = (int(RecordType.NEED), need.node, need.number)
            self.waiting[key] = _Waiting(build_records([need]), due_at)
        self._note_due()

    def asked_nodes(self) -> set[int]:
        """The robots that the waiting NEED records are about."""
        return {key[1] for key in self.waiting if _asks(key)}

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

    def ride(self, pdu: PduBuilder, start: float, number: int) -> None:
        """Move as many records as fit into PDU `number`, whose burst leaves at `start`.

        Receipts older than their field can express are dropped: they could be mistaken for those of
        another message.
        """
        oldest = start - MAX_SINCE * RECEIPT_UNIT_S
        for key in [
            key
            for key, each in self.waiting.items()
            if isinstance(each.record, Receipt) and each.since < oldest
        ]:
            del self.waiting[key]
        rides = [
            key for key, each in self.waiting.items() if pdu.add_record(each.as_of(start, number))
        ]
        for key in rides:
            del self.waiting[key]
        self._note_due()

    def _note_due(self) -> None:
        self.due_at = min((each.due_at for each in self.waiting.values()), default=inf)


def _asks(key: tuple[int, ...]) -> bool:
    """Whether a record asks for PDUs: a NEED without a number only answers."""
    return key[0] == RecordType.NEED and key[2] >= 0


def _made_later(record: Record) -> Beacon | Clock | None:
    """A record that tells the number of the PDU with it, which is known when it rides."""
    if isinstance(record, Beacon | Clock) and record.pdu_number is not None:
        return record
    return None
