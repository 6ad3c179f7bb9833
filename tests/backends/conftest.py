"""Permissions of an ordinary user, and radios that tolerate slow machines."""

import os

import pytest

from backends.testing import CONSTANTS
from phy import warm_up
from tests.soapy_loopback import missing, module_folder

NOBODY = 65534


@pytest.fixture(scope="session", autouse=True)
def _warm():
    """Compile first: on a fresh machine that takes longer than a hub may be late."""
    warm_up()


@pytest.fixture(scope="session", autouse=True)
def _test_radio():
    """Make SoapySDR find the test radio only: some other drivers take seconds to load."""
    with pytest.MonkeyPatch.context() as patch:
        if not missing():
            patch.setenv("SOAPY_SDR_PLUGIN_PATH", str(module_folder()))
            patch.setenv("SOAPY_SDR_ROOT", "/nonexistent")
        yield


@pytest.fixture
def own_rights(tmp_path, monkeypatch):
    """The permissions of an ordinary user, even if root runs the tests, in a folder of its own."""
    tmp_path.chmod(0o777)
    # By its full path, the folder would lie inside others that only root may read.
    monkeypatch.chdir(tmp_path)
    was = os.geteuid()
    if was == 0:
        os.seteuid(NOBODY)
    yield
    os.seteuid(was)
    for path in tmp_path.iterdir():
        path.chmod(0o700)


@pytest.fixture
def at_ease(monkeypatch):
    """Radios that make no gaps on a slow machine; radios and hubs that end quickly."""
    # Gaps have separate tests.
    monkeypatch.setattr(*CONSTANTS["loopback_max_behind_s"], 1e6)
    # Interval at which a waiting thread checks whether it should stop.
    monkeypatch.setattr(*CONSTANTS["hub_look_after_ms"], 20)
    monkeypatch.setattr(*CONSTANTS["real_time_ask_s"], 0.02)
    monkeypatch.setattr(*CONSTANTS["presence_ask_s"], 0.02)
    monkeypatch.setattr(*CONSTANTS["presence_quiet_s"], 0.2)
    monkeypatch.setattr(*CONSTANTS["real_time_max_behind_s"], 1e6)
