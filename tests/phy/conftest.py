"""The modem's library, built once before its tests, and a cache of what tests compile."""

import os
from pathlib import Path

import pytest
from numba.core.event import Event, Listener, install_listener

import phy
from phy.testing import files
from tests.cost import spent_s
from tests.tiers import Suite

# numba does not see that the code of a called function has changed.
_cache = Path(phy.__file__).parents[1] / "build" / "numba" / files.source_key()
os.environ.setdefault("NUMBA_CACHE_DIR", str(_cache))


class Compiling(Listener):
    """What numba compiles stays for all tests, so it is not charged to the one that is first."""

    def __init__(self, suite: Suite) -> None:
        self._suite = suite
        self._depth, self._begin_s = 0, 0.0

    def on_start(self, event: Event) -> None:
        if not self._depth:
            self._begin_s = spent_s()
        self._depth += 1

    def on_end(self, event: Event) -> None:
        self._depth -= 1
        if not self._depth:
            self._suite.share(spent_s() - self._begin_s)


@pytest.fixture(scope="session", autouse=True)
def _warm(pytestconfig):
    """Compile first: on a fresh machine that takes longer than a single test may."""
    phy.warm_up()
    suite = pytestconfig.pluginmanager.get_plugin(Suite.NAME)
    with install_listener("numba:compile", Compiling(suite)):
        yield
