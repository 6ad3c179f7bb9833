"""What takes a minute to make is made once, whichever process needs it first."""

import contextlib
import fcntl
import os
import shutil
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.packages.debian import ROOT, Debian, call, lacking

GIVEN = "SDRLINK_DEB"
WHEEL = (sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """All of them are long: they build packages and whole systems."""
    here = Path(__file__).parent
    for item in items:
        if here in item.path.parents:
            item.add_marker(pytest.mark.long)


@pytest.fixture(scope="session")
def once(
    tmp_path_factory: pytest.TempPathFactory, worker_id: str
) -> Iterator[Callable[[str, Callable[[Path], object]], Path]]:
    """Makes a folder by its name, once for all processes of a test run.

    The last of them to end removes all of it: systems are large.
    """
    parent = tmp_path_factory.getbasetemp()
    if worker_id != "master":
        parent = parent.parent
    shared, user = parent / "systems", parent / f"systems-used-by-{worker_id}"

    @contextlib.contextmanager
    def locked(name: str) -> Iterator[None]:
        with (parent / f"{name}.lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            yield

    def make(name: str, maker: Callable[[Path], object]) -> Path:
        with locked("systems"):
            shared.mkdir(exist_ok=True)
            user.touch()
        made = shared / f"{name}.made"
        with locked(name):
            if not made.exists():
                maker(shared / name)
                made.touch()
        return shared / name

    yield make
    with locked("systems"):
        user.unlink(missing_ok=True)
        if not list(parent.glob("systems-used-by-*")):
            shutil.rmtree(shared, ignore_errors=True)


@pytest.fixture(scope="session")
def wheels(once) -> tuple[Path, Path]:
    """(the daemon's, the client's), as `make wheel` makes them but for the compiled modem."""

    def build(folder: Path) -> None:
        for project in (ROOT, ROOT / "etc/client"):
            call(*WHEEL, folder, cwd=project)

    folder = once("wheels", build)
    return next(folder.glob("sdrlinkd-*.whl")), next(folder.glob("sdrlinkd_client-*.whl"))


@pytest.fixture(scope="session")
def base(once) -> Debian:
    """A fresh system that nothing was installed in; to be copied, not changed."""
    if why := lacking():
        pytest.skip(why)
    return Debian(once("debian", Debian.new))


@pytest.fixture(scope="session")
def deb(once) -> Path:
    """The package, as `make deb` makes it; or the one that GIVEN names."""
    if why := lacking():
        pytest.skip(why)
    if given := os.environ.get(GIVEN):
        return Path(given)

    def build(folder: Path) -> None:
        paths = {"DEB_BUILD": str(folder / "build"), "DEB_OUT": str(folder / "out")}
        call(
            "env",
            *(f"{name}={path}" for name, path in paths.items()),
            "sh",
            ROOT / "etc/deb/build.sh",
        )

    (found,) = (once("package", build) / "out").glob("sdrlinkd_*.deb")
    return found


@pytest.fixture(scope="session")
def installed(once, base: Debian, deb: Path) -> Debian:
    """A fresh system with the package; to be used, not changed."""
    return Debian(once("installed", lambda folder: base.copy(folder).install(deb)))


@pytest.fixture(scope="session")
def ready(once, base: Debian, deb: Path) -> Debian:
    """A system that has what the package needs, but not the package; to be copied."""

    def satisfy(folder: Path) -> None:
        needs = call("dpkg-deb", "-f", deb, "Depends").strip()
        base.copy(folder).run(f"apt-get satisfy -y -q '{needs}'")

    return Debian(once("ready", satisfy))


@pytest.fixture
def light(deb: Path) -> Callable[..., Path]:
    """Packs the package again without its libraries, which takes a second; `change` changes it."""

    def pack(folder: Path, change: Callable[[Path], None] = lambda _: None) -> Path:
        tree = folder / "light"
        tree.mkdir()
        call("dpkg-deb", "-e", deb, tree / "DEBIAN")
        unpack = f"dpkg-deb --fsys-tarfile {deb} | tar -x -C {tree} --exclude=./opt/sdrlinkd/lib"
        call("sh", "-c", unpack)
        sums = tree / "DEBIAN/md5sums"
        kept = [each for each in sums.read_text().splitlines() if "opt/sdrlinkd/lib/" not in each]
        sums.write_text("\n".join([*kept, ""]))
        change(tree)
        call(
            "dpkg-deb", "--root-owner-group", "-Zgzip", "-z1", "--build", tree, folder / "light.deb"
        )
        return folder / "light.deb"

    return pack
