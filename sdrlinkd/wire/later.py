"""A PDU that leaves later than it was made for."""

import struct
from binascii import crc_hqx

from sdrlinkd.wire.capacity import CRC_SIZE, ENTRY_HEADER_SIZE, HEADER_SIZE
from sdrlinkd.wire.control import MAX_AGE_US, TLV_HEADER_SIZE, RecordType
from sdrlinkd.wire.registry import CONTROL_TOPIC_ID

# Where in a record's value the time stands that counts up to the burst's preamble.
TIMES = {int(RecordType.STAMP): 2, int(RecordType.FRAME): 4}
_U32 = struct.Struct(">I")


def postponed(pdu: bytes, by_us: int) -> bytes:
    """A PDU of our own, with control channel, as it is when its burst leaves `by_us` µs later."""
    data = bytearray(pdu)
    n_entries = data[4] & 0x0F
    at = HEADER_SIZE + (n_entries + 1) // 2
    for i in range(n_entries):
        pair = data[HEADER_SIZE + i // 2]
        topic_id = pair >> 4 if i % 2 == 0 else pair & 0x0F
        length = int.from_bytes(data[at + 3 : at + 5], "big")
        begin = at + ENTRY_HEADER_SIZE
        at = begin + length
        if topic_id == CONTROL_TOPIC_ID:
            _move(data, begin, at, by_us)
    data[-CRC_SIZE:] = crc_hqx(data[:-CRC_SIZE], 0).to_bytes(CRC_SIZE, "big")
    return bytes(data)


def _move(data: bytearray, at: int, end: int, by_us: int) -> None:
    while at < end:
        kind, length = data[at], data[at + 1]
        offset = TIMES.get(kind)
        if offset is not None:
            where = at + TLV_HEADER_SIZE + offset
            (told,) = _U32.unpack_from(data, where)
            _U32.pack_into(data, where, min(told + by_us, MAX_AGE_US))
        at += TLV_HEADER_SIZE + length
