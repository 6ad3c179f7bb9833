"""The modem's kernels, compiled once before its tests."""

import pytest

from phy import warm_up


@pytest.fixture(scope="session", autouse=True)
def _warm():
    """Compile first: on a fresh machine that takes longer than a single test may."""
    warm_up()
