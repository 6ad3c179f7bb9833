"""Writes a drive: one MCAP file with reports, events and messages of one or several daemons."""

from pathlib import Path

import msgspec

from sdrlinkd.adapters import McapFile, Recorded
from sdrlinkd.drive.names import DRIVE, EVENT, STATUS, Event, topic_of
from sdrlinkd.errors import UserError
from sdrlinkd.json_schema import json_schema
from sdrlinkd.reports import Snapshot

_STATUS, _EVENT = json_schema(Snapshot), json_schema(Event)


class DriveWriter:
    """A drive in `folder`; times in ns since 1970. Raises UserError if there is one already.

    After each `sync` the file can be read up to there, even if this process is killed.
    """

    def __init__(self, folder: Path) -> None:
        self.path = folder / DRIVE
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._file = McapFile(self.path)
        except FileExistsError:
            raise UserError(f"{self.path}: is there already; give another folder") from None
        except OSError as error:
            raise UserError(f"{folder}: cannot be written ({error.strerror})") from None

    @property
    def n_bytes(self) -> int:
        """Size of the file so far, about."""
        return self._file.n_bytes

    def status(self, snapshot: Snapshot, at_ns: int) -> None:
        """Add a daemon's report."""
        topic = topic_of(snapshot.node, STATUS)
        self._file.add_json(topic, _STATUS, msgspec.json.encode(snapshot), at_ns)

    def event(self, event: Event, at_ns: int) -> None:
        """Add what has happened at a robot."""
        topic = topic_of(event.robot, EVENT)
        self._file.add_json(topic, _EVENT, msgspec.json.encode(event), at_ns)

    def message(self, topic: str, kind: str, cdr: bytes, at_ns: int) -> None:
        """Add a message under a name that `names.sent` or `names.received` gives."""
        self._file.add(Recorded(topic, kind, cdr, at_ns, at_ns))

    def sync(self) -> None:
        """Write what was added."""
        self._file.sync()

    def close(self) -> None:
        """Write the rest, and close the file."""
        self._file.sync()
        self._file.close()
