"""Writes bags: rosbag2 folders of MCAP files that are whole at every moment, even after a crash."""

import os
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from mcap.opcode import Opcode
from mcap.writer import CompressionType, Writer
from ruamel.yaml import YAML

from sdrlinkd.adapters.typestore import definition
from sdrlinkd.errors import BagError

METADATA = "metadata.yaml"
VERSION = 5
"""Version of metadata.yaml that Humble and later write or read."""
CHUNK_BYTES = 1 << 20
SECOND_NS = 1_000_000_000


class Recorded(NamedTuple):
    """A message to be recorded; times in ns since 1970."""

    topic: str
    type: str
    cdr: bytes
    received_ns: int
    published_ns: int
    is_latched: bool = False


@dataclass
class _Totals:
    """What metadata.yaml says of a file or a folder."""

    n_messages: int = 0
    begin_ns: int = 0
    end_ns: int = 0

    def add(self, time_ns: int) -> None:
        self.begin_ns = time_ns if not self.n_messages else min(self.begin_ns, time_ns)
        self.end_ns = max(self.end_ns, time_ns)
        self.n_messages += 1


class BagWriter:
    """A rosbag2 folder of MCAP files. After each `sync`, it can be read up to there.

    A file is followed by the next one after `split_s` seconds, or at `max_bytes`; 0: never. Raises
    BagError if the folder cannot be made.
    """

    def __init__(self, folder: Path, split_s: float = 0.0, max_bytes: int = 0) -> None:
        self._folder = folder
        self._split_ns, self._max_bytes = round(split_s * SECOND_NS), max_bytes
        self._all, self._of_file = _Totals(), list[_Totals]()
        self._counts: Counter[tuple[str, str, bool]] = Counter()
        try:
            folder.mkdir(parents=True)
        except OSError as error:
            raise BagError(
                f"{folder}: cannot be made ({error.strerror}); give a folder that does not exist"
            ) from None
        self._file = self._next_file()
        self._write_metadata()

    @property
    def n_messages(self) -> int:
        """Messages so far."""
        return self._all.n_messages

    @property
    def n_bytes(self) -> int:
        """Size of the files so far."""
        return sum(path.stat().st_size for path in self._folder.glob("*.mcap"))

    def add(self, message: Recorded) -> None:
        """Add a message; it is on disk after the next `sync`."""
        if self._is_full(message.received_ns):
            self.close()
            self._file = self._next_file()
        self._file.add(message)
        self._all.add(message.received_ns)
        self._of_file[-1].add(message.received_ns)
        self._counts[message.topic, message.type, message.is_latched] += 1

    def sync(self) -> None:
        """Write what was added, so that the bag is whole.

        The metadata come first: readers overlook topics that these do not list, and do not mind if
        there are fewer messages.
        """
        self._write_metadata()
        self._file.sync()

    def close(self) -> None:
        """Write the rest, and close the file."""
        self.sync()
        self._file.close()

    def _is_full(self, time_ns: int) -> bool:
        totals = self._of_file[-1]
        is_long = 0 < self._split_ns <= time_ns - totals.begin_ns
        is_large = 0 < self._max_bytes <= self._file.n_bytes
        return totals.n_messages > 0 and (is_long or is_large)

    def _next_file(self) -> "_File":
        self._of_file.append(_Totals())
        return _File(self._folder / self._name(len(self._of_file) - 1))

    def _name(self, number: int) -> str:
        return f"{self._folder.name}_{number}.mcap"

    def _write_metadata(self) -> None:
        files = [
            {"path": self._name(number), **_span(totals), "message_count": totals.n_messages}
            for number, totals in enumerate(self._of_file)
        ]
        topics = [
            {
                "topic_metadata": {
                    "name": topic,
                    "type": type_,
                    "serialization_format": "cdr",
                    "offered_qos_profiles": qos(is_latched),
                },
                "message_count": count,
            }
            for (topic, type_, is_latched), count in sorted(self._counts.items())
        ]
        information = {
            "version": VERSION,
            "storage_identifier": "mcap",
            "relative_file_paths": [each["path"] for each in files],
            **_span(self._all),
            "message_count": self._all.n_messages,
            "topics_with_message_count": topics,
            "compression_format": "",
            "compression_mode": "",
            "files": files,
        }
        written = self._folder / f".{METADATA}"
        with written.open("w") as file:
            YAML().dump({"rosbag2_bagfile_information": information}, file)
        written.replace(self._folder / METADATA)


class _File:
    """One MCAP file."""

    def __init__(self, path: Path) -> None:
        self._stream = _WholeStream(path)
        self._writer = _writer(self._stream)
        self._writer.start("ros2", "sdrlinkd")
        self._schemas: dict[str, int] = {}
        self._channels: dict[tuple[str, str, bool], int] = {}
        self._added = 0
        self.sync()

    @property
    def n_bytes(self) -> int:
        """Bytes so far, about."""
        return self._stream.tell() + self._added

    def add(self, message: Recorded) -> None:
        key = message.topic, message.type, message.is_latched
        channel = self._channels.get(key)
        if channel is None:
            channel = self._channels[key] = self._writer.register_channel(
                message.topic, "cdr", self._schema(message.type),
                {"offered_qos_profiles": qos(message.is_latched)},
            )  # fmt: skip
        self._writer.add_message(channel, message.received_ns, message.cdr, message.published_ns)
        self._added += len(message.cdr)

    def sync(self) -> None:
        self._writer.finish()  # type: ignore[no-untyped-call]
        self._stream.sync()
        self._added = 0

    def close(self) -> None:
        self._stream.close()

    def _schema(self, type_: str) -> int:
        if type_ not in self._schemas:
            text = definition(type_)
            self._schemas[type_] = self._writer.register_schema(
                type_, "ros2msg" if text else "", text.encode()
            )
        return self._schemas[type_]


def _writer(stream: Any) -> Writer:  # noqa: ANN401
    # Summary offsets, which are optional, would pile up with each `finish`.
    return Writer(stream, CHUNK_BYTES, compression=CompressionType.NONE, use_summary_offsets=False)


class _WholeStream:
    """A stream of which each `sync` writes all that is new, and the file's end, in one call.

    The next `sync` writes over that end, which a kill of this process cannot interrupt.
    """

    def __init__(self, path: Path) -> None:
        self._fd = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o644)
        self._base = 0
        self._new = bytearray()
        self._end_at: int | None = None

    def tell(self) -> int:
        return self._base + len(self._new)

    def write(self, data: bytes) -> int:
        if data[:1] == bytes((Opcode.DATA_END,)) and len(data) == 13:
            self._end_at = len(self._new)
        self._new += data
        return len(data)

    def flush(self) -> None:
        """Do nothing: `sync` writes."""

    def sync(self) -> None:
        os.pwrite(self._fd, self._new, self._base)
        if self._end_at is not None:
            self._base += self._end_at
        self._new.clear()
        self._end_at = None

    def close(self) -> None:
        os.close(self._fd)


def qos(is_latched: bool) -> str:
    """The QoS of a topic in the words of rosbag2."""
    durability = 1 if is_latched else 2
    forever = "\n    sec: 9223372036\n    nsec: 854775807"
    return (
        "- history: 1\n  depth: 10\n  reliability: 1\n"
        f"  durability: {durability}\n  deadline:{forever}\n  lifespan:{forever}\n"
        f"  liveliness: 1\n  liveliness_lease_duration:{forever}\n"
        "  avoid_ros_namespace_conventions: false"
    )


def _span(totals: _Totals) -> dict[str, Any]:
    return {
        "duration": {"nanoseconds": totals.end_ns - totals.begin_ns},
        "starting_time": {"nanoseconds_since_epoch": totals.begin_ns},
    }
