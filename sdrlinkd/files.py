"""Reads files that a person names, which may be anything."""

from pathlib import Path

from sdrlinkd.errors import UserError

MOST_BYTES = 1 << 20
"""Largest file of settings in octets."""


def read_bounded(path: Path, most: int = MOST_BYTES) -> bytes:
    """The octets of a file. Raises OSError, and UserError if there are more than `most`."""
    with path.open("rb") as file:
        data = file.read(most + 1)
    if len(data) > most:
        raise UserError(f"{path}: larger than {most} bytes; allowed: a file with settings")
    return data
