"""The client needs pyzmq and nothing else, from Python 3.10 on: ROS 2 Humble's."""

import importlib.util
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path
from shutil import copytree, which

import pytest
import zmq

ROOT = Path(__file__).parents[2]
PROGRAM = Path(__file__).with_name("alone.py")
VERMIN = Path(sys.executable).with_name("vermin")
FILES = (ROOT / "sdrlinkd/__init__.py", ROOT / "sdrlinkd/client", ROOT / "sdrlinkd/calls")


def call(*arguments, **options):
    """Output of a command; a failure includes it."""
    done = subprocess.run(
        [str(each) for each in arguments], capture_output=True, text=True, check=False, **options
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def python_3_10():
    """A real Python 3.10, or None if the machine has none."""
    found = [Path(name)] if (name := which("python3.10")) else []
    # A shim of pyenv may stand for a version that is not selected.
    for candidate in (*found, *sorted(Path.home().glob(".pyenv/versions/3.10.*/bin/python"))):
        tried = subprocess.run(
            [candidate, "-c", "import sys; sys.exit(sys.version_info[:2] != (3, 10))"],
            capture_output=True, check=False,
        )  # fmt: skip
        if tried.returncode == 0:
            return candidate
    return None


@pytest.fixture(scope="session")
def wheel(tmp_path_factory):
    """The client's own distribution."""
    folder = tmp_path_factory.mktemp("wheel")
    # Else pip fetches the build backend.
    here = ["--no-build-isolation"] if importlib.util.find_spec("hatchling") else []
    call(
        sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", *here, "--wheel-dir", folder,
        ROOT / "etc/client",
    )  # fmt: skip
    return next(folder.glob("*.whl"))


def run_alone(python, daemon):
    """Run the program next to this test, without anything of this source tree."""
    out = call(python, "-I", PROGRAM, daemon)
    nobody = f"no sdrlinkd answers in {daemon}/nobody"
    assert out.count(nobody) == 3
    assert 'topic: got "/robot_9/odom"; did you mean /robot_1/odom? allowed: ' in out
    assert 'qos: got "fast"; allowed: bulk, default, latency, urgent\n' in out
    assert out.endswith("modules\n")


@pytest.mark.slow
def test_the_language_is_python_3_10():
    call(VERMIN, "-t=3.10-", "--no-tips", "--violations", *FILES)
    call(sys.executable, "-m", "ruff", "check", "--isolated", "--target-version", "py310",
         "--select", "E9,F,UP", *FILES)  # fmt: skip
    call(
        sys.executable, "-m", "mypy", "--python-version", "3.10", "-p", "sdrlinkd.client", cwd=ROOT
    )


@pytest.mark.parametrize(
    "newer", ["from typing import Self", "import asyncio\nasyncio.timeout(1)", "import tomllib"]
)
def test_what_is_newer_would_be_seen(tmp_path, newer):
    path = tmp_path / "newer.py"
    path.write_text(newer + "\n")
    found = subprocess.run(
        [VERMIN, "-t=3.10-", "--no-tips", "--violations", path],
        capture_output=True, check=False,
    )  # fmt: skip
    assert found.returncode == 1


@pytest.mark.long
def test_the_wheel_is_the_client_alone(wheel, start_daemon, tmp_path):
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        (about,) = (archive.read(name).decode() for name in names if name.endswith("METADATA"))
    ours = {str(path.relative_to(ROOT)) for folder in FILES[1:] for path in folder.glob("*.py")}
    assert {name for name in names if name.endswith(".py")} == {
        f"sdrlinkd_client/{name}" for name in ("sdrlinkd/__init__.py", *ours)
    }
    assert [line for line in about.splitlines() if line.startswith("Requires-")] == [
        "Requires-Python: >=3.10", "Requires-Dist: pyzmq>=22.3",
    ]  # fmt: skip
    own = tomllib.loads((ROOT / "etc/client/pyproject.toml").read_text())["project"]
    assert own["dependencies"] == ["pyzmq>=22.3"]
    # Like `pip install`, but without an index.
    call(sys.executable, "-m", "venv", "--without-pip", tmp_path / "bare")
    site = next((tmp_path / "bare/lib").glob("python3.*/site-packages"))
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(site)
    installed = Path(zmq.__file__).parent
    for part in (installed, installed.with_name("pyzmq.libs")):
        if part.exists():
            copytree(part, site / part.name)
    run_alone(tmp_path / "bare/bin/python", start_daemon().directory)


@pytest.mark.long
def test_a_real_python_3_10(wheel, start_daemon, tmp_path):
    python = python_3_10()
    if python is None:
        return  # what can be told without one, the tests above tell
    call(python, "-m", "compileall", "-q", "-f", "-o", "0", *FILES,
         env={"PYTHONPYCACHEPREFIX": str(tmp_path / "cache")})  # fmt: skip
    call(python, "-m", "venv", tmp_path / "humble")
    installed = subprocess.run(
        [tmp_path / "humble/bin/python", "-m", "pip", "install", "--quiet", wheel],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    if installed.returncode:
        return  # no index within reach: it was compiled, at least
    run_alone(tmp_path / "humble/bin/python", start_daemon().directory)
