"""What an ordinary user may do, and how patient radios are here."""

import os

import pytest

from phy import warm_up
from tests.soapy_loopback import missing, module_folder

NOBODY = 65534


@pytest.fixture(scope="session", autouse=True)
def _warm():
    """Compiling takes longer on a fresh machine than a hub may be late."""
    warm_up()


@pytest.fixture(scope="session", autouse=True)
def _test_radio():
    """SoapySDR finds the test radio, and no other driver: some take seconds to load."""
    with pytest.MonkeyPatch.context() as patch:
        if not missing():
            patch.setenv("SOAPY_SDR_PLUGIN_PATH", str(module_folder()))
            patch.setenv("SOAPY_SDR_ROOT", "/nonexistent")
        yield


@pytest.fixture
def own_rights(tmp_path, monkeypatch):
    """The rights of an ordinary user, also where root runs the tests, in a folder of their own."""
    tmp_path.chmod(0o777)
    # By its whole name, the folder is behind others that are root's alone.
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
    """Radios that a slow machine does not make gaps in; radios and hubs that end soon."""
    # Gaps have tests of their own.
    monkeypatch.setattr("backends.loopback.MAX_BEHIND_S", 1e6)
    # Who waits in vain looks up so often.
    monkeypatch.setattr("backends.ether.hub.LOOK_AFTER_MS", 20)
    monkeypatch.setattr("backends.ether.radio.QUIET_MS", 50)
