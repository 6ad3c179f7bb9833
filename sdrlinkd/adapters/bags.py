"""Reads bags: rosbag2 (SQLite, MCAP) verbatim, ROS 1 bags converted, damaged bags partly."""

import contextlib
import functools
import shutil
import tempfile
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple, Protocol

import zstandard
from rosbags.highlevel import AnyReader
from rosbags.interfaces import (
    Connection,
    ConnectionExtRosbag2,
    Qos,
    QosDurability,
    QosHistory,
    QosReliability,
)

from sdrlinkd.adapters.mcap_bag import IndexedMcap, McapChannel, needs_mcap
from sdrlinkd.adapters.salvage import Piece, looks_cut, salvage
from sdrlinkd.adapters.salvage.bounds import ZSTD_HEADER_BYTES
from sdrlinkd.adapters.typestore import Ros1Converter, ros2_types
from sdrlinkd.errors import BagError

# Most characters of a reader's error that are shown.
MAX_REASON = 200
MOST_DEPTH = 10_000


class BagQos(NamedTuple):
    """The QoS that a topic's publishers offered; depth 0: not recorded."""

    reliability: str = "reliable"
    durability: str = "volatile"
    depth: int = 0

    @property
    def is_latched(self) -> bool:
        """Whether late joiners got the last messages."""
        return self.durability == "transient_local"

    def joined(self, other: "BagQos") -> "BagQos":
        """The QoS of two publishers of one topic: the stronger one of each."""
        return BagQos(
            max(self.reliability, other.reliability),
            min(self.durability, other.durability),
            max(self.depth, other.depth),
        )


class BagTopic(NamedTuple):
    """A topic of a recording; its name begins with a slash, even if the recorded name does not."""

    name: str
    type: str
    n_messages: int
    qos: BagQos = BagQos()


class BagMessage(NamedTuple):
    """A message of a recording: its CDR bytes, and its time in ns."""

    topic: str
    type: str
    time_ns: int
    cdr: bytes


class Bag(Protocol):
    """A recording that can be played."""

    path: Path
    damage: str
    """What could not be read, in words; empty if everything could."""
    skipped: dict[str, str]
    """Topics whose messages are neither ROS 2 nor ROS 1 messages, and their encoding."""

    def topics(self) -> list[BagTopic]:
        """Topics in the order of their names."""

    def messages(self) -> Iterator[BagMessage]:
        """All messages in order of time."""

    def close(self) -> None:
        """Close the recording's files."""


def open_bag(path: Path) -> Bag:
    """The recording at `path`: a rosbag2 folder, an .mcap, .db3 or ROS 1 .bag file.

    A damaged bag opens with its readable part; see `damage`. Raises BagError if there is none.
    """
    _refuse_bombs(path)
    try:
        if needs_mcap(path):
            return _McapBag(path)
        if looks_cut(path):
            return _DamagedBag(path, "shorter than its header says")
        return _WholeBag(path)
    except BagError:
        raise
    except FileNotFoundError as error:
        if path.exists():
            return _DamagedBag(path, _one_line(error))
        raise BagError(
            f"{path}: no such file or folder; a bag is a rosbag2 folder, .mcap, .db3 or .bag"
        ) from None
    except PermissionError as error:
        raise BagError(f"{path}: cannot be read ({error.strerror})") from None
    except Exception as error:
        # Readers report damage by many exceptions, including running out of memory.
        return _DamagedBag(path, _one_line(error))


def _refuse_bombs(path: Path) -> None:
    """Refuse compressed files that would fill the folder for temporary files. Raises BagError."""
    for file in path.glob("*.zstd") if path.is_dir() else []:
        room = shutil.disk_usage(tempfile.gettempdir()).free // 2
        if _expands_beyond(file, room):
            raise BagError(
                f"{file}: expands to more than {room} bytes, half of what is free in "
                f"{tempfile.gettempdir()}; decompress it first: zstd -d"
            )


def _expands_beyond(file: Path, most: int) -> bool:
    """Whether a zstd file holds more than `most` octets; not every one says how many."""
    with contextlib.suppress(OSError, zstandard.ZstdError), file.open("rb") as opened:
        size = zstandard.frame_content_size(opened.read(ZSTD_HEADER_BYTES))
        if size >= 0:
            return size > most
        opened.seek(0)
        found = 0
        for piece in zstandard.ZstdDecompressor().read_to_iter(opened):
            found += len(piece)
            if found > most:
                return True
    return False


class _WholeBag:
    """A bag that rosbags can open."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.damage = ""
        self.skipped: dict[str, str] = {}
        self._reader = AnyReader([path], default_typestore=ros2_types())
        self._reader.open()
        self._ros1 = None if self._reader.is2 else Ros1Converter(self._reader.typestore)

    def topics(self) -> list[BagTopic]:
        return _joined(
            BagTopic(_absolute(each.topic), each.msgtype, each.msgcount, _qos_of(each))
            for each in self._reader.connections
        )

    def messages(self) -> Iterator[BagMessage]:
        done = 0
        total = sum(topic.n_messages for topic in self.topics())
        try:
            for connection, time_ns, data in self._reader.messages():
                cdr = bytes(data)
                if self._ros1 is not None:
                    cdr = self._ros1.convert(cdr, connection.msgtype)
                done += 1
                yield BagMessage(_absolute(connection.topic), connection.msgtype, time_ns, cdr)
        except GeneratorExit:
            raise
        except Exception as error:
            # Readers report damage by many exceptions.
            self.damage = (
                f"{self.path}: unreadable after {done} of {total} messages ({_one_line(error)})"
            )

    def close(self) -> None:
        self._reader.close()


class _McapBag:
    """MCAP files of which not all messages are ROS 2 messages as rosbag2 writes them."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.damage = ""
        self._file = IndexedMcap(path)
        self.skipped = self._file.others
        self._converters: dict[str, Ros1Converter] = {}
        if not self._file.channels:
            self.close()
            told = ", ".join(f"{each} ({self.skipped[each]})" for each in sorted(self.skipped))
            raise BagError(
                f"{path}: none of its messages are ROS messages: {told or 'it is empty'}; allowed: "
                "the message encodings cdr and ros1"
            )

    def topics(self) -> list[BagTopic]:
        return _joined(
            BagTopic(_absolute(each.topic), each.type, each.n_messages, _strongest(each.qos))
            for each in self._file.channels
        )

    def messages(self) -> Iterator[BagMessage]:
        done = 0
        try:
            for channel, time_ns, data in self._file.messages():
                cdr = data if channel.encoding == "cdr" else self._convert(channel, data)
                done += 1
                yield BagMessage(_absolute(channel.topic), channel.type, time_ns, cdr)
        except GeneratorExit:
            raise
        except Exception as error:
            # Readers and converters report damage by many exceptions.
            self.damage = f"{self.path}: unreadable after {done} messages ({_one_line(error)})"

    def close(self) -> None:
        self._file.close()

    def _convert(self, channel: McapChannel, data: bytes) -> bytes:
        converter = self._converters.get(channel.type)
        if converter is None:
            converter = Ros1Converter.from_definition(channel.type, channel.definition)
            self._converters[channel.type] = converter
        return converter.convert(data, channel.type)


class _DamagedBag:
    """The readable part of a damaged bag, kept in memory to sort and count its messages."""

    def __init__(self, path: Path, why: str) -> None:
        self.path = path
        self.skipped: dict[str, str] = {}
        self._unconvertible: Counter[str] = Counter()
        self._converters: dict[str, Ros1Converter] = {}
        found = [message for piece in salvage(path) if (message := self._message(piece))]
        self._found = sorted(found, key=lambda message: message.time_ns)
        if not found:
            raise BagError(f"{path}: cannot be read ({why}), and nothing in it can be recovered")
        self.damage = f"{path}: damaged ({why}); {len(found)} messages recovered"
        for kind, count in self._unconvertible.items():
            self.damage += f"; {count} of type {kind} could not be converted"

    def topics(self) -> list[BagTopic]:
        counts = Counter((message.topic, message.type) for message in self._found)
        return [BagTopic(*key, count) for key, count in sorted(counts.items())]

    def messages(self) -> Iterator[BagMessage]:
        yield from self._found

    def close(self) -> None:
        self._found = []

    def _message(self, piece: Piece) -> BagMessage | None:
        kind = piece.type if "/msg/" in piece.type else piece.type.replace("/", "/msg/")
        if not piece.definition:
            return BagMessage(_absolute(piece.topic), kind, piece.time_ns, piece.data)
        try:
            converter = self._converters.get(kind)
            if converter is None:
                converter = Ros1Converter.from_definition(kind, piece.definition)
                self._converters[kind] = converter
            cdr = converter.convert(piece.data, kind)
        except Exception:
            # The conversion of a damaged message may raise any exception.
            self._unconvertible[kind] += 1
            return None
        return BagMessage(_absolute(piece.topic), kind, piece.time_ns, cdr)


def _joined(topics: Iterable[BagTopic]) -> list[BagTopic]:
    """Topics in the order of their names, each name and type once."""
    found: dict[tuple[str, str], BagTopic] = {}
    for topic in topics:
        known = found.get(topic[:2])
        found[topic[:2]] = (
            topic
            if known is None
            else known._replace(
                n_messages=known.n_messages + topic.n_messages, qos=known.qos.joined(topic.qos)
            )
        )
    return [found[key] for key in sorted(found)]


def _qos_of(connection: Connection) -> BagQos:
    """What a connection's publishers offered; ROS 1 knows latching alone."""
    ext = connection.ext
    if isinstance(ext, ConnectionExtRosbag2):
        return _strongest(ext.offered_qos_profiles)
    return BagQos(durability="transient_local", depth=1) if ext.latching else BagQos()


def _strongest(profiles: Iterable[Qos]) -> BagQos:
    offers = [
        BagQos(
            "best_effort" if each.reliability is QosReliability.BEST_EFFORT else "reliable",
            "transient_local" if each.durability is QosDurability.TRANSIENT_LOCAL else "volatile",
            min(each.depth, MOST_DEPTH) if each.history is QosHistory.KEEP_LAST else 0,
        )
        for each in profiles
    ]
    if not offers:
        return BagQos()
    # Each profile is that of a publisher with a history of its own.
    depth = 0 if any(each.depth == 0 for each in offers) else sum(each.depth for each in offers)
    return functools.reduce(BagQos.joined, offers)._replace(depth=min(depth, MOST_DEPTH))


def _absolute(name: str) -> str:
    """A topic's name with a leading slash; ROS 1 records names as the publisher gave them."""
    return f"/{name.removeprefix('/')}"


def _one_line(error: Exception) -> str:
    """An error's text on one line, as some readers' errors span many lines."""
    return (" ".join(str(error).split()) or type(error).__name__)[:MAX_REASON]
