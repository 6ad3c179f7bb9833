"""When any kernel changes, all are compiled anew.

A compiled kernel holds the code of those that it calls, and constants of other files. numba keeps
it until the function's own file changes; here the stamp on it is that of all the files beside it.
"""

import hashlib
from pathlib import Path
from typing import Any

from numba.core.caching import CacheImpl

_HERE = Path(__file__).parent


def _stamp() -> str:
    sources = b"".join(path.read_bytes() for path in sorted(_HERE.glob("*.py")))
    return hashlib.sha256(sources).hexdigest()


def _stamped(locator: Any, stamp: str) -> Any:
    class Stamped(locator):  # type: ignore[misc]
        def get_source_stamp(self) -> Any:
            own = super().get_source_stamp()
            return (own, stamp) if Path(self._py_file).parent == _HERE else own

    return Stamped


_found = _stamp()
CacheImpl._locator_classes = [_stamped(each, _found) for each in CacheImpl._locator_classes]  # noqa: SLF001
