"""The modem's library, built once before its tests, and a cache of what tests compile."""

import os
from pathlib import Path

import pytest

import phy
from phy.testing import files

# numba does not see that the code of a called function has changed.
_cache = Path(phy.__file__).parents[1] / "build" / "numba" / files.source_key()
os.environ.setdefault("NUMBA_CACHE_DIR", str(_cache))


@pytest.fixture(scope="session", autouse=True)
def _warm():
    """Compile first: on a fresh machine that takes longer than a single test may."""
    phy.warm_up()
