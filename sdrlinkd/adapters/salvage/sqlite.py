"""Messages from the readable part of a damaged rosbag2 SQLite file."""

import contextlib
import shutil
import sqlite3
import struct
import tempfile
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

from sdrlinkd.adapters.salvage.base import Piece
from sdrlinkd.adapters.salvage.bounds import MOST_ROWS, MOST_STEPS

# Offsets in the file header (https://www.sqlite.org/fileformat.html, section 1.3).
_HEADER_BYTES = 100
MIN_PAGE_SIZE = 512
STEPS = 1 << 20
"""Steps of SQLite's machine between two looks at the bound."""
_PAGE_SIZE_AT = 16
_PAGE_COUNT_AT = 28


def is_cut(path: Path) -> bool:
    """Whether the file has fewer pages than its header says."""
    page_size, pages = _layout(path)
    return page_size > 0 and path.stat().st_size < page_size * pages


def salvage(path: Path) -> Iterator[Piece]:
    """Every row before the first page that is missing or cannot be parsed."""
    page_size, _ = _layout(path)
    if page_size < MIN_PAGE_SIZE:
        return
    with tempfile.TemporaryDirectory() as folder:
        # SQLite refuses a file with fewer pages than its header says. With a corrected header in a
        # copy, it reads all rows except those that extend into missing pages.
        copy = Path(folder) / "copy.db3"
        shutil.copyfile(path, copy)
        pages = copy.stat().st_size // page_size
        with copy.open("r+b") as file:
            file.truncate(pages * page_size)
            file.seek(_PAGE_COUNT_AT)
            file.write(struct.pack(">I", pages))
        with contextlib.closing(sqlite3.connect(f"file:{copy}?mode=ro", uri=True)) as database:
            _bound(database)
            yield from _rows(database)


def _bound(database: sqlite3.Connection) -> None:
    """End queries that would not end: a view may be made of any number of rows."""
    database.execute("PRAGMA trusted_schema = OFF")
    left = MOST_STEPS // STEPS

    def is_over() -> bool:
        nonlocal left
        left -= 1
        return left < 0

    database.set_progress_handler(is_over, STEPS)


def _rows(database: sqlite3.Connection) -> Iterator[Piece]:
    with contextlib.suppress(sqlite3.Error, UnicodeDecodeError, OverflowError, MemoryError):
        topics = {
            number: (name, kind)
            for number, name, kind in database.execute("SELECT id, name, type FROM topics")
        }
        rows = database.execute("SELECT topic_id, timestamp, data FROM messages ORDER BY rowid")
        for number, time_ns, data in islice(rows, MOST_ROWS):
            if number in topics and isinstance(data, bytes) and isinstance(time_ns, int):
                yield Piece(*topics[number], time_ns, data)


def _layout(path: Path) -> tuple[int, int]:
    """(page size in bytes, number of pages) from the header; zeros if there is none."""
    with path.open("rb") as file:
        header = file.read(_HEADER_BYTES)
    if len(header) < _HEADER_BYTES or not header.startswith(b"SQLite format 3\0"):
        return 0, 0
    stored = struct.unpack_from(">H", header, _PAGE_SIZE_AT)[0]
    return 65536 if stored == 1 else stored, struct.unpack_from(">I", header, _PAGE_COUNT_AT)[0]
