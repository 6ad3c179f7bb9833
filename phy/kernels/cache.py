"""Where compiled kernels are kept, and until when.

A compiled kernel holds the code of those that it calls, and constants of other files. numba keeps
it until the function's own file changes; here the stamp on it is that of all the files beside it.

numba keeps it in $NUMBA_CACHE_DIR, beside the source or in the user's cache, and fails where none
of them can be written. Here a private temporary folder comes last; what cannot be kept at all is
compiled anew by the next process.
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
    """The temporary folder that kernels are kept in; None where a lasting one can be written."""
    return next(iter(_in_use), None)


class TemporaryCacheLocator(InTreeCacheLocator):
    """A cache in a temporary folder, for accounts without a home that run code of somebody else."""

    def __init__(self, py_func: Any, py_file: Any) -> None:
        super().__init__(py_func, py_file)
        folder = _private_folder()
        _in_use.add(folder)
        self._cache_path = str(folder / self.get_suitable_cache_subpath(py_file))

    @classmethod
    def from_function(cls, py_func: Any, py_file: Any) -> Any:
        """A locator for every file that exists: no other locator comes after this one."""
        return cls(py_func, py_file) if Path(py_file).exists() else None


@cache
def _private_folder() -> Path:
    """The user's own temporary folder, which later processes find again.

    What is in it is executed: a folder that others have made or may write to is not used.
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
        # Not one can be written.
        return "/tmp"  # noqa: S108 (nothing is written to it)


def _stamp() -> str:
    sources = b"".join(path.read_bytes() for path in sorted(_HERE.glob("*.py")))
    return hashlib.sha256(sources).hexdigest()


def _stamped(locator: Any, stamp: str) -> Any:
    class Stamped(locator):  # type: ignore[misc]
        def get_source_stamp(self) -> Any:
            own = super().get_source_stamp()
            return (own, stamp) if Path(self._py_file).parent == _HERE else own

    return Stamped


def _forgiving(method: Any) -> Any:
    """`method` without its OSErrors: a full disk or a lost folder costs time and nothing else."""

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
