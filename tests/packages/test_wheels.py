"""The wheels: the daemon's is whole, the client's is a part of it, and no file is in both."""

import subprocess
import sys
import zipfile

import pytest

from tests.packages.debian import ROOT, call

CLIENT = "sdrlinkd_client/"
PLACES = """
import importlib.util
print(importlib.util.find_spec("sdrlinkd.client").origin)
print(importlib.util.find_spec("phy") is not None)
"""


def names(wheel):
    with zipfile.ZipFile(wheel) as archive:
        return set(archive.namelist())


@pytest.fixture
def pip(tmp_path):
    """Runs pip in an environment without packages; pip itself is this environment's."""
    call(sys.executable, "-m", "venv", "--without-pip", tmp_path)
    return lambda *words: call(
        sys.executable, "-m", "pip", "--python", tmp_path / "bin/python", *words
    )


@pytest.fixture
def found(tmp_path):
    """Where the environment finds the client, and whether it has the daemon's packages.

    None if it has no client.
    """

    def look():
        done = subprocess.run(
            [tmp_path / "bin/python", "-I", "-c", PLACES],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        if done.returncode:
            assert "No module named 'sdrlinkd'" in done.stderr
            return None
        client, has_phy = done.stdout.split()
        return client, has_phy == "True"

    return look


def test_no_file_is_in_both(wheels):
    daemon, client = map(names, wheels)
    assert daemon & client == set()


def test_the_daemons_is_whole_and_needs_nothing_else_of_ours(wheels):
    there = names(wheels[0])
    for package in ("sdrlinkd", "phy", "backends"):
        for path in (ROOT / package).rglob("*"):
            if path.suffix in (".py", ".typed", ".c"):
                assert str(path.relative_to(ROOT)) in there
    with zipfile.ZipFile(wheels[0]) as archive:
        (about,) = (archive.read(name) for name in there if name.endswith("/METADATA"))
    assert b"Requires-Dist: sdrlinkd" not in about


def test_the_clients_is_a_part_of_the_daemons(wheels):
    daemon, client = map(names, wheels)
    ours = {name.removeprefix(CLIENT) for name in client if name.endswith((".py", ".typed"))}
    assert {"sdrlinkd/__init__.py", "sdrlinkd/client/publisher.py"} <= ours <= daemon


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
@pytest.mark.parametrize("removed", ["sdrlinkd", "sdrlinkd-client"])
def test_both_in_one_environment_come_and_go_without_each_other(wheels, pip, found, order, removed):
    install = ("install", "--no-deps", "--no-compile")
    pip(*install, *(wheels[each] for each in order[:1]))
    pip(*install, *(wheels[each] for each in order[1:]))
    client, has_phy = found()
    assert has_phy
    # The one that fits the daemon.
    assert CLIENT not in client
    # As an upgrade does.
    pip(*install, "--force-reinstall", wheels[order[0]])
    assert found() == (client, True)
    pip("uninstall", "--yes", removed)
    client, has_phy = found()
    assert (CLIENT in client, has_phy) == ((removed == "sdrlinkd"), removed != "sdrlinkd")
    pip("uninstall", "--yes", "sdrlinkd", "sdrlinkd-client")
    assert found() is None


def test_a_checkout_that_is_edited_comes_before_the_clients(wheels, pip, found):
    pip("install", "--no-deps", "--no-compile", wheels[1])
    pip("install", "--no-deps", "--editable", ROOT)
    assert found() == (str(ROOT / "sdrlinkd/client/__init__.py"), True)
