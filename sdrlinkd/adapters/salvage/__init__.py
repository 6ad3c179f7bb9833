"""What can still be read of damaged recordings. The readers of rosbags need whole files."""

from collections.abc import Iterator
from pathlib import Path

from sdrlinkd.adapters.salvage import mcap, ros1, sqlite
from sdrlinkd.adapters.salvage.base import Piece

__all__ = ["Piece", "salvage"]

_BY_SUFFIX = {".mcap": mcap.salvage, ".db3": sqlite.salvage, ".bag": ros1.salvage}


def salvage(path: Path) -> Iterator[Piece]:
    """Messages of the readable part of `path` (a file, or a rosbag2 folder), in file order."""
    files = sorted(path.iterdir()) if path.is_dir() else [path]
    for file in files:
        if file.suffix in _BY_SUFFIX:
            yield from _BY_SUFFIX[file.suffix](file)
