"""Messages from the readable part of a damaged ROS 1 bag (https://wiki.ros.org/Bags/Format/2.0)."""

import bz2
import struct
from collections.abc import Iterator
from pathlib import Path

import lz4.frame

from sdrlinkd.adapters.salvage.base import Piece
from sdrlinkd.adapters.salvage.bounds import MOST_BYTES

MAGIC = b"#ROSBAG V2.0\n"
_MESSAGE, _CHUNK, _CONNECTION = 2, 5, 7

Fields = dict[bytes, bytes]


def salvage(path: Path) -> Iterator[Piece]:
    """Every message up to the point where the file ends or parsing fails."""
    data = path.read_bytes()
    if not data.startswith(MAGIC):
        return
    connections: dict[bytes, tuple[str, str, str]] = {}
    for header, content in _top_records(data[len(MAGIC) :]):
        op = header.get(b"op", b"\0")[0]
        if op == _CONNECTION and b"conn" in header:
            about = dict(_fields(content))
            connections[header[b"conn"]] = (
                header.get(b"topic", b"").decode(errors="replace"),
                about.get(b"type", b"").decode(errors="replace"),
                about.get(b"message_definition", b"").decode(errors="replace"),
            )
        elif op == _MESSAGE and header.get(b"conn") in connections and len(header[b"time"]) == 8:
            topic, kind, definition = connections[header[b"conn"]]
            seconds, nanoseconds = struct.unpack("<II", header[b"time"])
            yield Piece(topic, kind, seconds * 10**9 + nanoseconds, content, definition)


def _top_records(data: bytes) -> Iterator[tuple[Fields, bytes]]:
    for header, content in _records(data):
        if header.get(b"op") == bytes((_CHUNK,)):
            yield from _records(_inflate(header.get(b"compression", b"none"), content))
        else:
            yield header, content


def _records(data: bytes) -> Iterator[tuple[Fields, bytes]]:
    at = 0
    while True:
        raw_header, at = _sized(data, at)
        header = dict(_fields(raw_header))
        if not header:
            return
        content, at = _sized(data, at)
        # A truncated chunk still has usable records, but a truncated message is lost.
        if at > len(data) and header.get(b"op") != bytes((_CHUNK,)):
            return
        yield header, content


def _sized(data: bytes, at: int) -> tuple[bytes, int]:
    """(field that follows its length, index after it); the end of the file may cut the field."""
    if at + 4 > len(data):
        return b"", len(data) + 1
    end = at + 4 + struct.unpack_from("<I", data, at)[0]
    return data[at + 4 : end], end


def _fields(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    at = 0
    while at + 4 <= len(data):
        field, at = _sized(data, at)
        name, separator, value = field.partition(b"=")
        if separator:
            yield name, value


def _inflate(compression: bytes, packed: bytes) -> bytes:
    try:
        if compression == b"bz2":
            return bz2.BZ2Decompressor().decompress(packed, MOST_BYTES)
        if compression == b"lz4":
            return bytes(lz4.frame.LZ4FrameDecompressor().decompress(packed, MOST_BYTES))
    except (OSError, EOFError, RuntimeError):
        return b""
    return packed if compression == b"none" else b""
