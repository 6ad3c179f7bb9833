"""Writes bags: rosbag2 folders of MCAP files that are whole at every moment, even after a crash."""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

from sdrlinkd.adapters.mcap_file import McapFile, Recorded, qos
from sdrlinkd.errors import BagError

METADATA = "metadata.yaml"
VERSION = 5
"""Version of metadata.yaml that Humble and later write or read."""
SECOND_NS = 1_000_000_000


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

    def _next_file(self) -> McapFile:
        self._of_file.append(_Totals())
        return McapFile(self._folder / self._name(len(self._of_file) - 1))

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


def _span(totals: _Totals) -> dict[str, Any]:
    return {
        "duration": {"nanoseconds": totals.end_ns - totals.begin_ns},
        "starting_time": {"nanoseconds_since_epoch": totals.begin_ns},
    }
