"""The modem's kernels, compiled once before its tests."""

import pytest

from phy import warm_up


@pytest.fixture(scope="session", autouse=True)
def _warm():
    """Compiling takes longer on a fresh machine than a single test may."""
    warm_up()
