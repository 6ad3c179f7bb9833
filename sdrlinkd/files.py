"""Looks at files and folders that a person names, which may be anything."""

import os
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


def unwritable(folder: Path) -> str:
    """Why this user could not make `folder`, or files in it; empty if nothing stands against it."""
    above = folder
    while not above.exists() and above != above.parent:
        above = above.parent
    if not above.is_dir():
        return f"{above} is not a directory"
    return "" if os.access(above, os.W_OK | os.X_OK) else f"no right to write to {above}"
