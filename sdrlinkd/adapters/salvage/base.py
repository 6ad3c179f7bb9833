"""The messages that salvage finds in a damaged recording."""

from typing import NamedTuple


class Piece(NamedTuple):
    """A message that could be read; `definition` is set only if the bag's format needs it."""

    topic: str
    type: str
    time_ns: int
    data: bytes
    definition: str = ""
