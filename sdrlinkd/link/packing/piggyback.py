"""Control records that ride in spare room."""

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
    build_records,
)

LASTING = frozenset({RecordType.CLOCK, RecordType.RECEIPT})
"""A beacon does not speak of the same."""


class _Waiting(NamedTuple):
    built: bytes
    due_at: float
    receipt: Receipt | None = None
    since: float = 0.0
    """When what the receipt tells of came about."""


class PiggybackRecords:
    """What waits for a PDU with room; each record knows from when on it deserves one of its own."""

    def __init__(self) -> None:
        self._waiting: dict[tuple[int, ...], _Waiting] = {}

    def __bool__(self) -> bool:
        return bool(self._waiting)

    @property
    def due_at(self) -> float:
        """When the first of them deserves a PDU of its own."""
        return min((each.due_at for each in self._waiting.values()), default=inf)

    def is_due(self, now: float) -> bool:
        """Whether one does."""
        return bool(self._waiting) and self.due_at <= now

    def holds(self, kind: RecordType) -> bool:
        """Whether a record of that type waits."""
        return any(key[0] == kind for key in self._waiting)

    def count(self, kind: RecordType) -> int:
        """How many records of that type wait."""
        return sum(key[0] == kind for key in self._waiting)

    def offer(self, records: Iterable[Record], due_at: float = -inf) -> None:
        """A beacon, in place of the one before."""
        kept = {key: each for key, each in self._waiting.items() if key[0] in LASTING}
        built = (build_records([record]) for record in records)
        # Two octets behind the header tell one from another of its type.
        self._waiting = {(*each[:1], *each[2:4]): _Waiting(each, due_at) for each in built}
        self._waiting |= kept

    def put(self, record: Record, due_at: float) -> None:
        """One more, in place of one of its type."""
        built = build_records([record])
        known = self._waiting.get((built[0],))
        self._waiting[built[0],] = _Waiting(built, due_at if known is None else known.due_at)

    def put_receipt(self, receipt: Receipt, due_at: float, since: float) -> None:
        """One more, of what came about at `since`."""
        built = build_records([receipt])
        key = (built[0], receipt.node, receipt.topic_id, receipt.entry_id)
        self._waiting[key] = _Waiting(built, due_at, receipt, since)

    def renew(self, record: Record) -> None:
        """Where a record of its type still waits, this one goes in its place."""
        built = build_records([record])
        for key, each in self._waiting.items():
            if key[0] == built[0]:
                self._waiting[key] = each._replace(built=built)

    def ride(self, pdu: PduBuilder, start: float) -> None:
        """As many as `pdu`, whose burst leaves at `start`, has room for.

        A receipt that is older than its field can say would be taken for another message's.
        """
        oldest = start - MAX_SINCE * RECEIPT_UNIT_S
        for key in [
            key for key, each in self._waiting.items() if each.receipt and each.since < oldest
        ]:
            del self._waiting[key]
        rides = [key for key, each in self._waiting.items() if pdu.add_record(_as_of(each, start))]
        for key in rides:
            del self._waiting[key]


def _as_of(waiting: _Waiting, start: float) -> bytes:
    if waiting.receipt is None:
        return waiting.built
    since = min(max(round((start - waiting.since) / RECEIPT_UNIT_S), 0), MAX_SINCE)
    return build_records([waiting.receipt._replace(since_100us=since)])
