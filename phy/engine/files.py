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
BESIDE = _PHY / "engine" / "libraries"
_PREFIX, _SUFFIX = "kernels-", ".so"


def place(target: Target) -> Path:
    """The file for a library that this user builds, in the first folder that is fit for it.

    Raises OSError if nothing can be written.
    """
    for folder in folders():
        with contextlib.suppress(OSError):
            folder.mkdir(mode=0o755, parents=True, exist_ok=True)
            if os.access(folder, os.W_OK) and _is_trusted(folder):
                return folder / name_of(target)
    # Another user was quicker to take the name of the temporary folder.
    return Path(tempfile.mkdtemp(prefix="sdrlinkd-")) / name_of(target)


def fitting() -> Path | None:
    """The best library of this source that this machine can run, if there is one."""
    for target in (this(), *(each for each in FAMILIES if each.fits)):
        for folder in folders():
            found = folder / name_of(target)
            if _is_trusted(folder) and _is_trusted(found):
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


def folders() -> Iterator[Path]:
    """Beside the source, the user's cache, and a temporary folder that later processes find."""
    yield BESIDE
    given = os.environ.get("XDG_CACHE_HOME")
    with contextlib.suppress(RuntimeError):
        yield (Path(given) if given else Path("~/.cache").expanduser()) / "sdrlinkd"
    with contextlib.suppress(OSError):
        yield Path(tempfile.gettempdir()) / f"sdrlinkd-{os.geteuid()}"


def _is_trusted(path: Path) -> bool:
    """Whether only this user, the owner of the source or root can have written a file or a folder.

    What is beside the source is as good as the source.
    """
    try:
        found = path.stat()
        owners = {0, os.geteuid(), Path(__file__).stat().st_uid}
    except OSError:
        return False
    if BESIDE in (path, path.parent):
        return True
    return found.st_uid in owners and not found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
