"""MCAP files that rosbag2 has not written: ROS 1 messages, and the names of other encodings."""

import os
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import IO, NamedTuple

import lz4.frame
import zstandard
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.reader import McapReader, make_reader
from mcap.records import Channel, Schema
from mcap.summary import Summary
from rosbags.interfaces import Qos
from rosbags.rosbag2.metadata import parse_qos

from sdrlinkd.adapters.salvage.bounds import MOST_BYTES, PIECE, ZSTD_HEADER_BYTES

HEAD = b"\x89MCAP0\r\n\x01"
"""The magic, and the opcode of the header."""
ROS2, ROS1 = "cdr", "ros1"
"""Message encodings that can be played."""
PROFILE = "ros2"
_CHUNK = struct.Struct("<BQQQQII")
"""Opcode, length, two times, size, CRC-32, and the length of the compression's name."""
_RECORD = struct.Struct("<BQ")
_LENGTH = struct.Struct("<Q")


class McapChannel(NamedTuple):
    """A channel of messages: `definition` is the schema's text."""

    topic: str
    type: str
    encoding: str
    definition: str
    n_messages: int
    qos: list[Qos]


def needs_mcap(path: Path) -> bool:
    """Whether `path` is an MCAP file with an index that rosbag2 would not have written.

    Raises McapError if it is damaged.
    """
    if path.suffix != ".mcap" or not path.is_file():
        return False
    with path.open("rb") as stream:
        if stream.read(len(HEAD)) != HEAD:
            return False
        summary = _summary(stream)
        if summary is None:
            return False
        encodings = {each.message_encoding for each in summary.channels.values()}
        return _reader(stream).get_header().profile != PROFILE or not encodings <= {ROS2, ""}


class IndexedMcap:
    """The messages of an MCAP file with an index. Raises McapError if it is damaged."""

    def __init__(self, path: Path) -> None:
        self._stream: IO[bytes] = path.open("rb")
        self.others: dict[str, str] = {}
        self._by_id: dict[int, McapChannel] = {}
        try:
            self._index()
        except BaseException:
            self.close()
            raise

    @property
    def channels(self) -> list[McapChannel]:
        """The channels with ROS messages."""
        return list(self._by_id.values())

    def messages(self) -> Iterator[tuple[McapChannel, int, bytes]]:
        """(channel, time in ns, octets) of each ROS message, in order of time."""
        topics = [each.topic for each in self._by_id.values()]
        for _, channel, message in _reader(self._stream).iter_messages(topics=topics):
            if (found := self._by_id.get(channel.id)) is not None:
                yield found, message.log_time, message.data

    def close(self) -> None:
        """Close the file."""
        self._stream.close()

    def _index(self) -> None:
        """Find the channels, and refuse chunks that would expand without end."""
        summary = _summary(self._stream)
        if summary is None or summary.statistics is None:
            raise McapError("no index")
        if not summary.chunk_indexes and _has_chunk(self._stream):
            raise McapError("no chunk is in the index")
        for index in summary.chunk_indexes:
            _refuse_bomb(self._stream, index.chunk_start_offset)
        counts = summary.statistics.channel_message_counts
        for number, channel in summary.channels.items():
            schema = summary.schemas.get(channel.schema_id)
            if channel.message_encoding in (ROS2, ROS1) and schema is not None:
                self._by_id[number] = _channel(channel, schema, counts.get(number, 0))
            else:
                self.others[channel.topic] = channel.message_encoding or "no encoding"


def _summary(stream: IO[bytes]) -> Summary | None:
    """The index at the end of a file; None if there is none."""
    return _reader(stream).get_summary()


def _reader(stream: IO[bytes]) -> McapReader:
    stream.seek(0)
    return make_reader(stream)


def _refuse_bomb(stream: IO[bytes], at: int) -> None:
    """Raise McapError if the chunk at an offset expands to more than MOST_BYTES.

    The index says so too, but the reader goes by the chunk itself.
    """
    stream.seek(at)
    try:
        opcode, *_, size, _, length = _CHUNK.unpack(stream.read(_CHUNK.size))
        compression = stream.read(min(length, 16))
        (n_packed,) = _LENGTH.unpack(stream.read(_LENGTH.size))
        if opcode != Opcode.CHUNK:
            raise McapError("its index is wrong")
        if compression == b"zstd":
            frame = stream.read(min(n_packed, ZSTD_HEADER_BYTES))
            size = max(size, zstandard.frame_content_size(frame))
        elif compression == b"lz4":
            size = max(size, _lz4_size(stream, n_packed))
    except (struct.error, zstandard.ZstdError, RuntimeError) as error:
        raise McapError(str(error)) from None
    if size > MOST_BYTES:
        raise McapError(f"a chunk of more than {MOST_BYTES} bytes")


def _has_chunk(stream: IO[bytes]) -> bool:
    """Whether there is a chunk before the end of the messages."""
    stream.seek(len(HEAD) - 1)
    while len(head := stream.read(_RECORD.size)) == _RECORD.size:
        opcode, length = _RECORD.unpack(head)
        if opcode in (Opcode.CHUNK, Opcode.DATA_END):
            return bool(opcode == Opcode.CHUNK)
        stream.seek(length, os.SEEK_CUR)
    return False


def _lz4_size(stream: IO[bytes], n_packed: int) -> int:
    """Octets of an LZ4 frame, decompressed: up to MOST_BYTES and a piece, which are not kept."""
    lz4_frame, size = lz4.frame.LZ4FrameDecompressor(), 0
    while not lz4_frame.eof and size <= MOST_BYTES:
        packed = stream.read(min(n_packed, PIECE)) if lz4_frame.needs_input else b""
        if lz4_frame.needs_input and not packed:
            break
        n_packed -= len(packed)
        size += len(lz4_frame.decompress(packed, PIECE))
    return size


def _channel(channel: Channel, schema: Schema, n_messages: int) -> McapChannel:
    kind = schema.name if "/msg/" in schema.name else schema.name.replace("/", "/msg/")
    offered = channel.metadata.get("offered_qos_profiles", "")
    return McapChannel(
        channel.topic, kind, channel.message_encoding, schema.data.decode(), n_messages,
        parse_qos(offered) if offered else [],
    )  # fmt: skip
