"""MCAP files that rosbag2 has not written: ROS 1 messages, and the names of other encodings."""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import IO, NamedTuple

import zstandard
from mcap.exceptions import McapError
from mcap.reader import McapReader, make_reader
from mcap.records import Channel, ChunkIndex, Schema
from mcap.summary import Summary
from rosbags.interfaces import Qos
from rosbags.rosbag2.metadata import parse_qos

from sdrlinkd.adapters.salvage.bounds import MOST_BYTES

HEAD = b"\x89MCAP0\r\n\x01"
"""The magic, and the opcode of the header."""
ROS2, ROS1 = "cdr", "ros1"
"""Message encodings that can be played."""
PROFILE = "ros2"
ZSTD_HEADER_BYTES = 18
_CHUNK = struct.Struct("<BQQQQII")
"""Opcode, length, two times, size, CRC-32, and the length of the compression's name."""


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
        for index in summary.chunk_indexes:
            _refuse_bomb(self._stream, index)
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


def _refuse_bomb(stream: IO[bytes], index: ChunkIndex) -> None:
    """Raise McapError for a chunk of more than MOST_BYTES, by its index or by its own word."""
    size = index.uncompressed_size
    stream.seek(index.chunk_start_offset)
    head = stream.read(_CHUNK.size)
    if len(head) == _CHUNK.size and index.compression == "zstd":
        *_, own, _, length = _CHUNK.unpack(head)
        frame = stream.read(min(length, 16) + 8 + ZSTD_HEADER_BYTES)[length + 8 :]
        try:
            size = max(size, own, zstandard.frame_content_size(frame))
        except zstandard.ZstdError as error:
            raise McapError(str(error)) from None
    if size > MOST_BYTES:
        raise McapError(f"a chunk of {size} bytes")


def _channel(channel: Channel, schema: Schema, n_messages: int) -> McapChannel:
    kind = schema.name if "/msg/" in schema.name else schema.name.replace("/", "/msg/")
    offered = channel.metadata.get("offered_qos_profiles", "")
    return McapChannel(
        channel.topic, kind, channel.message_encoding, schema.data.decode(), n_messages,
        parse_qos(offered) if offered else [],
    )  # fmt: skip
