"""An XRCE-DDS session on a serial line, best effort (DDS-XRCE 1.0, chapter 8).

The FCU is the client: it writes with WRITE_DATA, and receives DATA from the agent. The creation of
client, participant, topics, readers and writers is assumed to be done. Time synchronisation uses
TIMESTAMP and TIMESTAMP_REPLY; unlike with eProsima's agent, either side may ask.
"""

import struct
from collections.abc import Iterator

from benchmarks.peers.latency.job import ANSWERED, ASKED, REPLY, REQUEST
from benchmarks.peers.latency.xrce_framing import Deframer, frame

ADDRESSES = {"companion": 0, "fcu": 1}
"""The agent's and the client's addresses, as in eProsima's software."""
HEADER = struct.Struct("<BBH")
"""Session, stream, sequence number; sessions from 0x80 on omit the client's key."""
SUBHEADER = struct.Struct("<BBH")
"""Submessage, flags, length."""
OBJECT = struct.Struct(">HH")
"""A writer's or reader's request: its number, the object (12 bits of number, 4 of kind)."""
TIME = struct.Struct("<iI")
"""Seconds, nanoseconds."""
SESSION = 0x81
NO_STREAM, BEST_EFFORT = 0x00, 0x01
LITTLE_ENDIAN = 0x01
WRITE_DATA, DATA, TIMESTAMP, TIMESTAMP_REPLY = 7, 9, 14, 15
DATA_WRITER, DATA_READER = 5, 6
GIGA = 10**9


class Xrce:
    """One end's encoder and parser."""

    def __init__(self, side: str) -> None:
        self._address = ADDRESSES[side]
        client = side == "fcu"
        self._submessage, self._expected = (WRITE_DATA, DATA) if client else (DATA, WRITE_DATA)
        self._object = DATA_WRITER if client else DATA_READER
        self._deframer = Deframer(self._address)
        self._sequence = 0

    def encode(self, kind: int, payload: bytes) -> bytes:
        """Encode a message as one frame with one submessage."""
        if kind == REQUEST:
            return self._frame(NO_STREAM, 0, TIMESTAMP, _time(*ASKED.unpack(payload)))
        if kind == REPLY:
            originated, received, sent = map(_time, ANSWERED.unpack(payload))
            return self._frame(NO_STREAM, 0, TIMESTAMP_REPLY, sent + received + originated)
        self._sequence = (self._sequence + 1) % (1 << 16)
        head = OBJECT.pack(0, kind << 4 | self._object)
        return self._frame(BEST_EFFORT, self._sequence, self._submessage, head + payload)

    def _frame(self, stream: int, sequence: int, submessage: int, payload: bytes) -> bytes:
        header = HEADER.pack(SESSION, stream, sequence)
        subheader = SUBHEADER.pack(submessage, LITTLE_ENDIAN, len(payload))
        return frame(self._address, 1 - self._address, header + subheader + payload)

    def decode(self, chunk: bytes) -> Iterator[tuple[int, bytes]]:
        """Decode what the other side's `encode` made; anything else is skipped."""
        for message in self._deframer.feed(chunk):
            if len(message) < HEADER.size + SUBHEADER.size:
                continue
            submessage, _, length = SUBHEADER.unpack_from(message, HEADER.size)
            payload = message[HEADER.size + SUBHEADER.size :][:length]
            if submessage == self._expected and len(payload) >= OBJECT.size:
                yield OBJECT.unpack_from(payload)[1] >> 4, payload[OBJECT.size :]
            elif submessage == TIMESTAMP and length == len(payload) == TIME.size:
                yield REQUEST, ASKED.pack(_ns(payload, 0))
            elif submessage == TIMESTAMP_REPLY and length == len(payload) == 3 * TIME.size:
                sent, received, originated = (_ns(payload, i) for i in range(3))
                yield REPLY, ANSWERED.pack(originated, received, sent)


def _time(ns: int) -> bytes:
    return TIME.pack(*divmod(ns, GIGA))


def _ns(payload: bytes, which: int) -> int:
    seconds, nanoseconds = TIME.unpack_from(payload, which * TIME.size)
    return int(seconds * GIGA + nanoseconds)
