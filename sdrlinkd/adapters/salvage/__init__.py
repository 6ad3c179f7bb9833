"""Reads the intact part of damaged bags, as the readers of rosbags need intact files."""

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import zstandard

from sdrlinkd.adapters.salvage import mcap, ros1, sqlite
from sdrlinkd.adapters.salvage.base import Piece
from sdrlinkd.adapters.salvage.bounds import MOST_BYTES

__all__ = ["Piece", "looks_cut", "salvage"]

_BY_SUFFIX: dict[str, Callable[[Path], Iterator[Piece]]] = {
    ".mcap": mcap.salvage,
    ".db3": sqlite.salvage,
    ".bag": ros1.salvage,
}
_PER_MESSAGE = re.compile(r"compression_mode:\s*[\'\"]?message", re.IGNORECASE)


def looks_cut(path: Path) -> bool:
    """Whether a database in `path` is shorter than its header says; SQLite would read zeros."""
    return any(sqlite.is_cut(file) for file in _files(path) if file.suffix == ".db3")


def salvage(path: Path) -> Iterator[Piece]:
    """Messages of the readable part of `path` (a file, or a rosbag2 folder), in file order."""
    compressed = _is_compressed_per_message(path)
    for file in _files(path):
        for piece in _readable_part(file):
            if not compressed:
                yield piece
            elif (data := _inflate(piece.data)) is not None:
                yield piece._replace(data=data)


def _files(path: Path) -> list[Path]:
    return sorted(file for file in path.iterdir() if file.is_file()) if path.is_dir() else [path]


def _readable_part(file: Path) -> Iterator[Piece]:
    if file.suffix not in _BY_SUFFIX:
        return
    try:
        yield from _BY_SUFFIX[file.suffix](file)
    except GeneratorExit:
        raise
    except Exception:
        # The readable part of a damaged file ends where parsing fails.
        return


def _is_compressed_per_message(path: Path) -> bool:
    metadata = path / "metadata.yaml"
    return metadata.is_file() and bool(_PER_MESSAGE.search(metadata.read_text(errors="replace")))


def _inflate(data: bytes) -> bytes | None:
    try:
        return zstandard.ZstdDecompressor().decompress(data, max_output_size=MOST_BYTES)
    except zstandard.ZstdError:
        return None
