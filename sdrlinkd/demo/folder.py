"""The folder of a run, and what runs that were killed have left."""

import contextlib
import fcntl
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import IO

PREFIX = "sdrlink-"
LOCK = "run.lock"


@contextlib.contextmanager
def run_folder() -> Iterator[Path]:
    """A folder while it is used by `with`. Those of runs that have died are removed before."""
    _sweep(Path(tempfile.gettempdir()))
    with tempfile.TemporaryDirectory(prefix=PREFIX) as name:
        folder = Path(name)
        # Locked before it has its name: else another run could take it for that of a dead one.
        unnamed = folder / f"{LOCK}.new"
        with unnamed.open("w") as file:
            fcntl.flock(file, fcntl.LOCK_EX)
            unnamed.rename(folder / LOCK)
            yield folder


def _sweep(temporary: Path) -> None:
    for lock in temporary.glob(f"{PREFIX}*/{LOCK}"):
        with contextlib.suppress(OSError):
            if lock.lstat().st_uid == os.geteuid():
                with lock.open() as file:
                    _remove(file, lock.parent)


def _remove(file: IO[str], folder: Path) -> None:
    """Unless its run holds the lock, which makes it a BlockingIOError."""
    fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    shutil.rmtree(folder, ignore_errors=True)
