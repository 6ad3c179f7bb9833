"""One MCAP file that is whole at every moment, even after a crash."""

import json
import os
from pathlib import Path
from typing import Any, NamedTuple

from mcap.opcode import Opcode
from mcap.writer import CompressionType, Writer

from sdrlinkd.adapters.typestore import definition

CHUNK_BYTES = 1 << 20


class Recorded(NamedTuple):
    """A message to be recorded; times in ns since 1970."""

    topic: str
    type: str
    cdr: bytes
    received_ns: int
    published_ns: int
    is_latched: bool = False


class McapFile:
    """One MCAP file. After each `sync`, it is whole, even if this process is killed."""

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
        """Add a message; it is on disk after the next `sync`."""
        key = message.topic, message.type, message.is_latched
        channel = self._channels.get(key)
        if channel is None:
            channel = self._channels[key] = self._writer.register_channel(
                message.topic, "cdr", self._schema(message.type),
                {"offered_qos_profiles": qos(message.is_latched)},
            )  # fmt: skip
        self._writer.add_message(channel, message.received_ns, message.cdr, message.published_ns)
        self._added += len(message.cdr)

    def add_json(self, topic: str, schema: dict[str, Any], data: bytes, time_ns: int) -> None:
        """Add JSON; `schema` is its JSON schema, with a title."""
        key = topic, schema["title"], False
        channel = self._channels.get(key)
        if channel is None:
            number = self._writer.register_schema(
                schema["title"], "jsonschema", json.dumps(schema).encode()
            )
            channel = self._channels[key] = self._writer.register_channel(topic, "json", number)
        self._writer.add_message(channel, time_ns, data, time_ns)
        self._added += len(data)

    def sync(self) -> None:
        """Write what was added."""
        self._writer.finish()  # type: ignore[no-untyped-call]
        self._stream.sync()
        self._added = 0

    def close(self) -> None:
        """Close the file as it is after the last `sync`."""
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
        self._fd = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o640)
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
