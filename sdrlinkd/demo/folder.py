"""The temporary folder of a run; removes the folders of killed runs."""

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
    """A temporary folder for use in `with`; first removes the folders of runs that have died."""
    _sweep(Path(tempfile.gettempdir()))
    with tempfile.TemporaryDirectory(prefix=PREFIX) as name:
        folder = Path(name)
        # Lock the file before renaming it; else another run could take it for that of a dead run.
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
    """Remove a run's folder. Raises BlockingIOError if the run still holds its lock."""
    fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    shutil.rmtree(folder, ignore_errors=True)
