"""Messages from the readable part of a damaged MCAP file (https://mcap.dev/spec)."""

import contextlib
import struct
from collections.abc import Iterator
from pathlib import Path

import lz4.frame
import zstandard

from sdrlinkd.adapters.salvage.base import Piece
from sdrlinkd.adapters.salvage.bounds import MOST_BYTES, PIECE

MAGIC = b"\x89MCAP0\r\n"
ENCODINGS = ("cdr", "", "ros1")
"""Message encodings that can be played; others are no ROS messages."""
_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK = 3, 4, 5, 6
_RECORD = struct.Struct("<BQ")


def salvage(path: Path) -> Iterator[Piece]:
    """Every message up to the point where the file ends or parsing fails."""
    data = path.read_bytes()
    if not data.startswith(MAGIC):
        return
    schemas: dict[int, tuple[str, str]] = {}
    channels: dict[int, tuple[str, str, str]] = {}
    for op, content in _top_records(data[len(MAGIC) :]):
        if op == _SCHEMA:
            name, at = _text(content, 2)
            _, at = _text(content, at)
            definition = content[at + 4 :].decode(errors="replace")
            schemas[int.from_bytes(content[:2], "little")] = (name, definition)
        elif op == _CHANNEL:
            number, schema = struct.unpack_from("<HH", content)
            topic, at = _text(content, 4)
            encoding, _ = _text(content, at)
            name, definition = schemas.get(schema, ("", ""))
            if encoding in ENCODINGS:
                channels[number] = (topic, name, definition if encoding == "ros1" else "")
        elif op == _MESSAGE:
            number, _, time_ns, _ = struct.unpack_from("<HIQQ", content)
            if number in channels:
                topic, name, definition = channels[number]
                yield Piece(topic, name, time_ns, content[22:], definition)


def _top_records(data: bytes) -> Iterator[tuple[int, bytes]]:
    for op, content in _records(data, cut_chunks=True):
        if op == _CHUNK:
            yield from _records(_inflate(content), cut_chunks=False)
        else:
            yield op, content


def _records(data: bytes, *, cut_chunks: bool) -> Iterator[tuple[int, bytes]]:
    at = 0
    while at + _RECORD.size <= len(data):
        op, length = _RECORD.unpack_from(data, at)
        at += _RECORD.size
        content = data[at : at + length]
        if len(content) < length and not (cut_chunks and op == _CHUNK):
            return
        yield op, content
        at += length


def _inflate(chunk: bytes) -> bytes:
    """The records of a chunk, as far as its compressed bytes can be decompressed."""
    try:
        compression, at = _text(chunk, 28)
        packed = chunk[at + 8 :]
        if compression == "zstd":
            return _as_far_as_possible(packed)
        if compression == "lz4":
            return bytes(lz4.frame.LZ4FrameDecompressor().decompress(packed, MOST_BYTES))
    except (struct.error, UnicodeDecodeError, zstandard.ZstdError, RuntimeError):
        return b""
    return packed if not compression else b""


def _as_far_as_possible(packed: bytes) -> bytes:
    """What a zstd frame holds, up to its damage or MOST_BYTES."""
    found = bytearray()
    zstd = zstandard.ZstdDecompressor()
    with (
        contextlib.suppress(zstandard.ZstdError),
        zstd.stream_reader(packed, read_across_frames=True) as reader,
    ):
        while len(found) < MOST_BYTES and (piece := reader.read(PIECE)):
            found += piece
    return bytes(found)


def _text(data: bytes, at: int) -> tuple[str, int]:
    end = at + 4 + struct.unpack_from("<I", data, at)[0]
    return data[at + 4 : end].decode(), end
