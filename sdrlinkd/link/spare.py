"""Control records that ride in spare room."""

from collections.abc import Iterable

from sdrlinkd.wire import PduBuilder, Record, build_records


class SpareRecords:
    """What waits for a PDU with room; true while something does."""

    def __init__(self) -> None:
        self._waiting: list[bytes] = []

    def __bool__(self) -> bool:
        return bool(self._waiting)

    def offer(self, records: Iterable[Record]) -> None:
        """To send in the PDUs to come, in place of what was offered before."""
        self._waiting = [build_records([record]) for record in records]

    def renew(self, record: Record) -> None:
        """Where a record of its type still waits, this one goes in its place."""
        built = build_records([record])
        self._waiting = [built if each[0] == built[0] else each for each in self._waiting]

    def ride(self, pdu: PduBuilder) -> None:
        """As many as `pdu` has room for."""
        self._waiting = [record for record in self._waiting if not pdu.add_record(record)]
