"""Checksums of header and PDUs."""

import zlib

CRC32_SIZE = 4


def _crc8_of_byte(value: int) -> int:
    for _ in range(8):
        value = (value << 1 ^ 0x07 if value & 0x80 else value << 1) & 0xFF
    return value


_CRC8_TABLE = bytes(map(_crc8_of_byte, range(256)))


def crc8(data: bytes) -> int:
    """CRC-8, polynomial x^8 + x^2 + x + 1, initial value 0 (check value 0xF4)."""
    crc = 0
    for byte in data:
        crc = _CRC8_TABLE[crc ^ byte]
    return crc


def with_crc32(data: bytes) -> bytes:
    """`data` followed by its CRC-32 (as in zlib), big endian."""
    return data + zlib.crc32(data).to_bytes(CRC32_SIZE, "big")


def checked(data: bytes) -> bytes | None:
    """`data` without its CRC-32, the last four octets; None if that is wrong."""
    body = data[:-CRC32_SIZE]
    right = zlib.crc32(body).to_bytes(CRC32_SIZE, "big") == data[-CRC32_SIZE:]
    return body if right else None
