"""Where libraries of kernels lie, and which of them fits."""

import contextlib
import hashlib
import os
import stat
import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from phy.engine.targets import FAMILIES, Target, this

SYMBOL = "phy_"
"""A library's functions are the kernels' names after this."""
_PHY = Path(__file__).parents[1]
_BESIDE = _PHY / "engine" / "libraries"
_PREFIX, _SUFFIX = "kernels-", ".so"


def place(target: Target) -> Path:
    """The file for a library that this user builds, in the first folder that can be written."""
    for folder in _folders():
        with contextlib.suppress(OSError):
            folder.mkdir(mode=0o755, parents=True, exist_ok=True)
            if os.access(folder, os.W_OK):
                return folder / name_of(target)
    return Path(tempfile.gettempdir()) / name_of(target)


def fitting() -> Path | None:
    """The best library of this source that this machine can run, if there is one."""
    for target in (this(), *(each for each in FAMILIES if each.fits)):
        for folder in _folders():
            found = folder / name_of(target)
            if _is_trusted(found):
                return found
    return None


def name_of(target: Target) -> str:
    """A library's file name: what it is for, and the key of the source."""
    return f"{_PREFIX}{target.name}-{source_key()}{_SUFFIX}"


def target_of(path: Path) -> str:
    """What a library is for, in words."""
    name = path.name.removeprefix(_PREFIX).removesuffix(f"-{source_key()}{_SUFFIX}")
    return "this machine" if name == this().name else f"any {name}"


@cache
def source_key() -> str:
    """The key of the kernels' source: a library of any other source is never loaded."""
    names = ("kernels/*.py", "tables/*.py", "sizes.py")
    of_engine = ("builder.py", "call.c", "compile.py", "entries.py")
    found = [path for name in names for path in _PHY.glob(name)]
    key = hashlib.sha256()
    for each in (*sorted(found), *(_PHY / "engine" / name for name in of_engine)):
        key.update(each.read_bytes())
    return key.hexdigest()[:16]


def _folders() -> Iterator[Path]:
    """Beside the source, the user's cache, and a temporary folder of the user's own."""
    yield _BESIDE
    given = os.environ.get("XDG_CACHE_HOME")
    with contextlib.suppress(RuntimeError):
        yield (Path(given) if given else Path("~/.cache").expanduser()) / "sdrlinkd"
    with contextlib.suppress(OSError):
        yield _private_folder()


def _private_folder() -> Path:
    """The user's own temporary folder. Raises OSError if others may write to it."""
    folder = Path(tempfile.gettempdir()) / f"sdrlinkd-{os.geteuid()}"
    folder.mkdir(mode=0o700, exist_ok=True)
    found = folder.lstat()
    is_ours = stat.S_ISDIR(found.st_mode) and found.st_uid == os.geteuid()
    if not is_ours or stat.S_IMODE(found.st_mode) & 0o077:
        raise PermissionError(f"{folder}: others may write there")
    return folder


def _is_trusted(path: Path) -> bool:
    """Whether only this user, the owner of the source or root can have written a library.

    One beside the source is as good as the source.
    """
    if path.parent == _BESIDE:
        return path.is_file()
    try:
        owners = {0, os.geteuid(), Path(__file__).stat().st_uid}
        file, folder = path.stat(), path.parent.stat()
    except OSError:
        return False
    return stat.S_ISREG(file.st_mode) and all(
        each.st_uid in owners and not each.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
        for each in (file, folder)
    )
