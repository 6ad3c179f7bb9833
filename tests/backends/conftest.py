"""What an ordinary user may do."""

import os

import pytest

NOBODY = 65534


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
