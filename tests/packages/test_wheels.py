"""The wheels: the daemon's needs the client's, and no file is in both."""

import subprocess
import sys
import zipfile

import pytest

from sdrlinkd import __version__
from tests.packages.debian import ROOT, call

BUILD = (sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d")


@pytest.fixture(scope="module")
def wheels(tmp_path_factory):
    """(the daemon's, the client's)."""
    folder = tmp_path_factory.mktemp("wheels")
    for project in (ROOT, ROOT / "etc/client"):
        call(*BUILD, folder, cwd=project)
    return next(folder.glob("sdrlinkd-*.whl")), next(folder.glob("sdrlinkd_client-*.whl"))


def names(wheel):
    with zipfile.ZipFile(wheel) as archive:
        return set(archive.namelist())


def test_no_file_is_in_both(wheels):
    daemon, client = map(names, wheels)
    assert daemon & client == set()
    assert {"sdrlinkd/__init__.py", "sdrlinkd/client/publisher.py"} <= client
    assert {"sdrlinkd/daemon.py", "phy/receiver.py", "backends/__init__.py"} <= daemon


def test_together_they_are_the_whole_package(wheels):
    both = names(wheels[0]) | names(wheels[1])
    for package in ("sdrlinkd", "phy", "backends"):
        for path in (ROOT / package).rglob("*"):
            if path.suffix in (".py", ".typed", ".c"):
                assert str(path.relative_to(ROOT)) in both


def test_the_daemons_needs_the_clients_of_the_same_version(wheels):
    with zipfile.ZipFile(wheels[0]) as archive:
        (about,) = (archive.read(name) for name in archive.namelist() if name.endswith("METADATA"))
    assert f"Requires-Dist: sdrlinkd-client=={__version__}\n" in about.decode()


def test_in_one_environment_either_may_come_first_and_be_installed_again(wheels, tmp_path):
    daemon, client = wheels
    call(sys.executable, "-m", "venv", "--without-pip", tmp_path)
    python = tmp_path / "bin/python"
    for order in ((daemon, client), (client, daemon)):
        for wheel in order:
            call(
                sys.executable, "-m", "pip", "--python", python, "install", "--no-deps",
                "--force-reinstall", "--no-compile", wheel,
            )  # fmt: skip
        code = "import sdrlinkd.shipped, sdrlinkd.client.paths as paths; print(paths.__file__)"
        loaded = subprocess.run(
            [python, "-I", "-c", code], capture_output=True, text=True, check=False
        )
        # Only pyzmq is missing, which nothing here installs.
        assert "No module named 'zmq'" in loaded.stderr
        found = {
            path.name for path in (tmp_path / "lib").glob("python3.*/site-packages/sdrlinkd/*")
        }
        assert {"__init__.py", "client", "daemon.py"} <= found
