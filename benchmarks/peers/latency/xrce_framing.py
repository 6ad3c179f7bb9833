"""Frames on a serial line, as in DDS-XRCE 1.0 (11.3) and eProsima's client and agent.

    0x7E, source, destination, length (2), payload, CRC-16 of the payload (2); little-endian

After the first byte, 0x7E and 0x7D are sent as 0x7D and the byte XOR 0x20. There is no end marker.
"""

import re
import struct
from collections.abc import Iterator

BEGIN, ESCAPE = b"\x7e", b"\x7d"
FLIP = 0x20
ESCAPED = re.compile(rb"\x7d(.)", re.DOTALL)
HEAD = struct.Struct("<BBH")
"""Source, destination, length."""
CRC = struct.Struct("<H")
MOST = 512
"""Bytes of payload: the usual MTU of a serial transport."""
POLYNOMIAL = 0xA001
"""x^16 + x^15 + x^2 + 1, lowest bit first."""


def _crc_table() -> list[int]:
    table = []
    for byte in range(256):
        rest = byte
        for _ in range(8):
            rest = rest >> 1 ^ (POLYNOMIAL if rest & 1 else 0)
        table.append(rest)
    return table


CRC_TABLE = _crc_table()


def crc16(data: bytes) -> int:
    """The CRC-16/ARC of these bytes."""
    crc = 0
    for byte in data:
        crc = crc >> 8 ^ CRC_TABLE[(crc ^ byte) & 0xFF]
    return crc


def stuff(data: bytes) -> bytes:
    """`data` escaped, so that no byte is 0x7E."""
    return data.replace(ESCAPE, b"\x7d\x5d").replace(BEGIN, b"\x7d\x5e")


def unstuff(data: bytes) -> bytes:
    """Undo `stuff`. An incomplete escape at the end is dropped."""
    return ESCAPED.sub(lambda found: bytes([found[1][0] ^ FLIP]), data.removesuffix(ESCAPE))


def frame(source: int, destination: int, payload: bytes) -> bytes:
    """Make a frame for the line."""
    head = HEAD.pack(source, destination, len(payload))
    return BEGIN + stuff(head + payload + CRC.pack(crc16(payload)))


class Deframer:
    """Finds frames in a stream of any chunks; damaged ones and those for others are skipped."""

    def __init__(self, address: int) -> None:
        self._address = address
        self._raw = bytearray()

    def feed(self, chunk: bytes) -> Iterator[bytes]:
        """Payloads of the frames that end within this chunk."""
        self._raw += chunk
        while (begin := self._raw.find(BEGIN)) >= 0:
            end = self._raw.find(BEGIN, begin + 1)
            open_ended = end < 0
            if open_ended:
                end = len(self._raw)
            body = unstuff(bytes(self._raw[begin + 1 : end]))
            if open_ended and not _complete(body):
                del self._raw[:begin]
                return
            del self._raw[:end]
            if (payload := self._payload(body)) is not None:
                yield payload
        self._raw.clear()

    def _payload(self, body: bytes) -> bytes | None:
        if not _complete(body):
            return None
        _, destination, length = HEAD.unpack_from(body)
        if length > MOST or destination != self._address:
            return None
        payload = body[HEAD.size : HEAD.size + length]
        (crc,) = CRC.unpack_from(body, HEAD.size + length)
        return payload if crc == crc16(payload) else None


def _complete(body: bytes) -> bool:
    """Whether the frame is complete, or can never become a valid one."""
    if len(body) < HEAD.size:
        return False
    length: int = HEAD.unpack_from(body)[2]
    return length > MOST or len(body) >= HEAD.size + length + CRC.size
