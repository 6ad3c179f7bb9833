"""Where compiled kernels are cached, and for how long.

A compiled kernel contains the code of the functions that it calls, and constants of other files.
numba considers it valid until the function's own file changes; here it is valid until any file in
the folder, or the file of sizes beside it, changes.

numba caches kernels in $NUMBA_CACHE_DIR, beside the source or in the user's cache, and fails if it
can write to none of them. Here a private temporary folder is the last choice, and if that fails too
each process compiles its kernels anew.
"""

import contextlib
import hashlib
import os
import stat
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

from numba.core.caching import CacheImpl, FunctionCache, InTreeCacheLocator

_HERE = Path(__file__).parent
_in_use: set[Path] = set()


def temporary_cache() -> Path | None:
    """The temporary folder with the cached kernels; None if a permanent folder is writable."""
    return next(iter(_in_use), None)


class TemporaryCacheLocator(InTreeCacheLocator):
    """A cache in a temporary folder, for accounts without a home that run another user's code."""

    def __init__(self, py_func: Any, py_file: Any) -> None:
        super().__init__(py_func, py_file)
        folder = _private_folder()
        _in_use.add(folder)
        self._cache_path = str(folder / self.get_suitable_cache_subpath(py_file))

    @classmethod
    def from_function(cls, py_func: Any, py_file: Any) -> Any:
        """A locator for every existing file: no other locator comes after this one."""
        return cls(py_func, py_file) if Path(py_file).exists() else None


@cache
def _private_folder() -> Path:
    """The user's own temporary folder, which later processes find again.

    Its content is executed, so a folder that other users own or may write to is rejected.
    """
    folder = Path(_temporary()) / f"sdrlinkd-{os.geteuid()}"
    with contextlib.suppress(OSError):
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
        is_ours = stat.S_ISDIR(found.st_mode) and found.st_uid == os.geteuid()
        if is_ours and not stat.S_IMODE(found.st_mode) & 0o077:
            return folder
    with contextlib.suppress(OSError):
        return Path(tempfile.mkdtemp(prefix=f"sdrlinkd-{os.geteuid()}-", dir=_temporary()))
    return folder


def _temporary() -> str:
    try:
        return tempfile.gettempdir()
    except FileNotFoundError:
        # None of them is writable.
        return "/tmp"  # noqa: S108 (nothing is written to it)


def _stamp() -> str:
    files = [*sorted(_HERE.glob("*.py")), _HERE.parent / "sizes.py"]
    sources = b"".join(path.read_bytes() for path in files)
    return hashlib.sha256(sources).hexdigest()


def _stamped(locator: Any, stamp: str) -> Any:
    class Stamped(locator):  # type: ignore[misc]
        def get_source_stamp(self) -> Any:
            own = super().get_source_stamp()
            return (own, stamp) if Path(self._py_file).parent == _HERE else own

    return Stamped


def _forgiving(method: Any) -> Any:
    """`method` with its OSErrors suppressed: a full disk or a lost folder only costs time."""

    def call(*arguments: Any) -> Any:
        with contextlib.suppress(OSError):
            return method(*arguments)

    return call


_found = _stamp()
CacheImpl._locator_classes = [  # noqa: SLF001
    _stamped(each, _found)
    for each in (*CacheImpl._locator_classes, TemporaryCacheLocator)  # noqa: SLF001
]
for _name in ("load_overload", "save_overload"):
    setattr(FunctionCache, _name, _forgiving(getattr(FunctionCache, _name)))
