"""Messages from the readable part of a damaged rosbag2 SQLite file."""

import contextlib
import os
import shutil
import sqlite3
import struct
import tempfile
from collections.abc import Iterator
from pathlib import Path

from sdrlinkd.adapters.salvage.base import Piece

_HEADER_BYTES = 100
_FILLING_BYTES = 16


def salvage(path: Path) -> Iterator[Piece]:
    """Every row before the first page that is missing or makes no sense."""
    with path.open("rb") as file:
        header = file.read(_HEADER_BYTES)
    if len(header) < _HEADER_BYTES or not header.startswith(b"SQLite format 3\0"):
        return
    page_size = struct.unpack_from(">H", header, 16)[0]
    pages = struct.unpack_from(">I", header, 28)[0]
    with tempfile.TemporaryDirectory() as folder:
        # SQLite refuses a file shorter than its header says. Filled up, it reads until a page
        # makes no sense; the filling is random so that a row which reaches into it is known.
        whole = Path(folder) / "whole.db3"
        shutil.copyfile(path, whole)
        filling = os.urandom(_FILLING_BYTES)
        missing = (65536 if page_size == 1 else page_size) * pages - whole.stat().st_size
        with whole.open("ab") as file:
            file.write(filling * (max(0, missing) // len(filling) + 1))
        with contextlib.closing(sqlite3.connect(f"file:{whole}?mode=ro", uri=True)) as database:
            yield from _rows(database, filling)


def _rows(database: sqlite3.Connection, filling: bytes) -> Iterator[Piece]:
    with contextlib.suppress(sqlite3.Error, UnicodeDecodeError):
        topics = {
            number: (name, kind)
            for number, name, kind in database.execute("SELECT id, name, type FROM topics")
        }
        rows = database.execute("SELECT topic_id, timestamp, data FROM messages ORDER BY rowid")
        for number, time_ns, data in rows:
            if filling in data:
                return
            if number in topics and isinstance(data, bytes):
                yield Piece(*topics[number], time_ns, data)
