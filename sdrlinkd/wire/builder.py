"""Fills a PDU entry by entry, up to its capacity."""

import struct
from functools import lru_cache

from sdrlinkd.wire.capacity import CRC_SIZE, ENTRY_HEADER_SIZE, MAX_ENTRIES, entry_budget
from sdrlinkd.wire.control import ASKS, STAMP_RECORD, STAMP_SIZE, TLV_HEADER_SIZE
from sdrlinkd.wire.crc import crc16
from sdrlinkd.wire.declared import FIRST_NUMBER, number_octet
from sdrlinkd.wire.record_types import RecordType
from sdrlinkd.wire.registry import CONTROL_TOPIC_ID, DECLARED_TOPIC_ID

VERSION = 0
FLAG_COMPRESSED = 0x02
FLAG_SEALED = 0x01

HEADER = struct.Struct(">BBBBB")
ENTRY_HEADER = struct.Struct(">BBBH")
_SOLE = struct.Struct(">9BH")


@lru_cache(maxsize=8)
def _budgets(pdu_size: int) -> tuple[int, ...]:
    """`entry_budget` for 0 to 15 entries, followed by 0 for 16 entries."""
    return (*(entry_budget(pdu_size, n) for n in range(MAX_ENTRIES + 1)), 0)


class PduBuilder:
    """Fills a PDU and tracks the bytes left; the caller decides on the content.

    `room` is the largest payload of one more entry, and `room_beside_stamp` the largest one if a
    STAMP is added, too; negative: no entry fits. All control records share one entry, the last.
    """

    __slots__ = (
        "_budgets", "_parts", "_pdu_size", "_records", "_records_size", "_topic_ids", "_used",
        "room", "room_beside_stamp",
    )  # fmt: skip

    def __init__(self, pdu_size: int) -> None:
        self._pdu_size = pdu_size
        self._budgets = budgets = _budgets(pdu_size)
        self._parts: list[bytes] = []
        self._topic_ids: list[int] = []
        self._used = 0
        self._records: list[bytes] = []
        self._records_size = 0
        self.room = budgets[1] - ENTRY_HEADER_SIZE
        self.room_beside_stamp = budgets[2] - 2 * ENTRY_HEADER_SIZE - STAMP_SIZE

    @property
    def is_empty(self) -> bool:
        """Whether there are neither entries nor records yet."""
        return not self._topic_ids and not self._records

    def add(self, topic_id: int, entry_id: int, index: int, total: int, payload: bytes) -> None:
        """Add an entry; one of a declared topic has its number ahead of `payload`.

        Raises ValueError if it does not fit or a field is out of range.
        """
        if topic_id >= FIRST_NUMBER:
            payload = number_octet(topic_id) + payload
            topic_id = DECLARED_TOPIC_ID
        size = len(payload)
        if size > self.room or index >= total or topic_id < 0:
            raise ValueError(
                f"entry {index} of {total}, topic id {topic_id}, {size} bytes: allowed are an "
                f"index below the total, a topic id and {self.room} bytes"
            )
        try:
            header = ENTRY_HEADER.pack(entry_id, index, total, size)
        except struct.error as error:
            raise ValueError(f"a field does not fit its octets: {error}") from None
        self._parts += (header, payload)
        self._topic_ids.append(topic_id)
        self._used += ENTRY_HEADER_SIZE + size
        self._note_room()

    def add_record(self, record: bytes) -> bool:
        """Add a control record; returns False, without adding it, if it does not fit."""
        n = len(self._topic_ids) + 1
        size = self._records_size + len(record)
        if n > MAX_ENTRIES or self._used + ENTRY_HEADER_SIZE + size > self._budgets[n]:
            return False
        self._records.append(record)
        self._records_size = size
        self._note_room()
        return True

    def add_stamp(self, topic_id: int, entry_id: int, age_us: int, asks: bool = False) -> bool:
        """Add a STAMP record; False if it does not fit. `asks`: the sender wants a RECEIPT.

        Every message has a STAMP, so for speed it is built without `build_records`.
        """
        value_size = STAMP_SIZE - TLV_HEADER_SIZE + asks
        record = STAMP_RECORD.pack(RecordType.STAMP, value_size, topic_id & 0xFF, entry_id, age_us)
        return self.add_record(record + ASKS if asks else record)

    def _note_room(self) -> None:
        """Update `room` and `room_beside_stamp`."""
        budgets, size = self._budgets, self._records_size
        n = len(self._topic_ids)
        # A control entry takes its header, its records, and one more entry in the count.
        with_control = budgets[min(n + 2, MAX_ENTRIES + 1)] - self._used - size
        self.room_beside_stamp = with_control - STAMP_SIZE - 2 * ENTRY_HEADER_SIZE
        if size:
            self.room = with_control - 2 * ENTRY_HEADER_SIZE
        else:
            self.room = budgets[n + 1] - self._used - ENTRY_HEADER_SIZE

    def build(
        self, flags: int, src: int, dst: int, seq: int, hop: int, control_entry_id: int = 0
    ) -> bytes:
        """The PDU's octets. Raises ValueError if it has no entries or a field is out of range."""
        ids = self._topic_ids
        if self._records:
            header = ENTRY_HEADER.pack(control_entry_id, 0, 1, self._records_size)
            self._parts += (header, *self._records)
            ids.append(CONTROL_TOPIC_ID)
        n = len(ids)
        if n == 0:
            raise ValueError(f"a PDU holds 1 to {MAX_ENTRIES} entries, not 0")
        if not 0 <= hop <= 15:
            raise ValueError(f"hop is {hop}, allowed 0 to 15")
        try:
            header = HEADER.pack(flags, src, dst, seq, hop << 4 | n)
        except struct.error as error:
            raise ValueError(f"a field does not fit its octet: {error}") from None
        if n == 1:
            nibbles = bytes((ids[0] << 4,))
        elif n == 2:
            nibbles = bytes((ids[0] << 4 | ids[1],))
        else:
            padded = [*ids, 0]
            nibbles = bytes(padded[i] << 4 | padded[i + 1] for i in range(0, n, 2))
        body = b"".join((header, nibbles, *self._parts)).ljust(self._pdu_size - CRC_SIZE, b"\0")
        return body + crc16(body).to_bytes(2, "big")


def build_full(
    flags: int, src: int, dst: int, seq: int, hop: int,
    topic_id: int, entry_id: int, index: int, total: int, payload: bytes,
) -> bytes:  # fmt: skip
    """The octets of a PDU with one entry and no PAD; fields must be in range."""
    if topic_id >= FIRST_NUMBER:
        payload = number_octet(topic_id) + payload
        topic_id = DECLARED_TOPIC_ID
    body = b"".join(
        (
            _SOLE.pack(flags, src, dst, seq, hop << 4 | 1, topic_id << 4, entry_id, index, total,
                       len(payload)),
            payload,
        )
    )  # fmt: skip
    return body + crc16(body).to_bytes(2, "big")
