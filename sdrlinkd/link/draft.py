"""One PDU while it is being filled."""

from collections.abc import Sequence

from sdrlinkd.link.outbox import Outgoing
from sdrlinkd.link.qos import WIRE_BITS, Qos
from sdrlinkd.wire import (
    CONTROL_TOPIC_ID,
    ENTRY_HEADER_SIZE,
    MAX_ENTRIES,
    Entry,
    Pdu,
    Record,
    build,
    build_records,
    entry_budget,
)


class Draft:
    """Knows the bytes left; never computes who should have them."""

    def __init__(self, pdu_size: int) -> None:
        self._pdu_size = pdu_size
        self._used = 0
        self._records = b""
        self._record_entries = 0
        self.dst = -1  # until the first entry decides
        self.qos = Qos.BULK
        self.entries: list[Entry] = []
        self.carried: list[Outgoing] = []

    @property
    def is_empty(self) -> bool:
        """Nothing in it yet, neither entries nor control records."""
        return not self.entries and not self._records

    @property
    def room(self) -> int:
        """Payload bytes that one more entry could have; negative: none."""
        n = len(self.entries) + self._record_entries + 1
        if n > MAX_ENTRIES:
            return -1
        return entry_budget(self._pdu_size, n) - self._used - ENTRY_HEADER_SIZE

    def room_beside_records(self, size: int) -> int:
        """`room` after control records of `size` bytes were added as well."""
        if self._records:
            return self.room - size
        n = len(self.entries) + 2
        if n > MAX_ENTRIES:
            return -1
        return entry_budget(self._pdu_size, n) - self._used - size - 2 * ENTRY_HEADER_SIZE

    def add(self, message: Outgoing, entry: Entry) -> None:
        """Add an entry that fits."""
        self.entries.append(entry)
        self.carried.append(message)
        self._used += ENTRY_HEADER_SIZE + len(entry.payload)
        self.dst = message.dst
        self.qos = min(self.qos, message.qos)

    def add_records(self, records: Sequence[Record]) -> bool:
        """Add control records if they fit."""
        payload = build_records(list(records))
        if self._records:
            if self._rest() < len(payload):
                return False
        else:
            if self.room < len(payload):
                return False
            self._record_entries = 1
            self._used += ENTRY_HEADER_SIZE
        self._records += payload
        self._used += len(payload)
        return True

    def build(self, src: int, seq: int, hop: int, control_entry_id: int) -> bytes:
        """The PDU's bytes."""
        entries = self.entries
        if self._records:
            control = Entry(CONTROL_TOPIC_ID, control_entry_id, 0, 1, self._records)
            entries = [control, *entries]
        return build(
            Pdu(WIRE_BITS[self.qos], False, src, self.dst, seq, hop, entries), self._pdu_size
        )

    def _rest(self) -> int:
        """Bytes left for more payload inside the entries there are."""
        return entry_budget(self._pdu_size, len(self.entries) + self._record_entries) - self._used
