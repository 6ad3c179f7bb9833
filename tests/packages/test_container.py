"""The container's last stage, built on a fresh system with the package."""

import re
import shutil

import pytest

from tests.machine import lacks
from tests.packages.debian import BUILDER, ROOT, call

CONTAINERFILE = ROOT / "Containerfile"
BUILT = "COPY --from=build /src/dist/"
"""How the last stage takes the package from the first."""
USED = """
id -un
sdrlinkd --check
sdrlinkd &
until sdrlinkctl status; do sleep 0.2; done
kill $!
wait $!
"""


@pytest.fixture
def buildah(tmp_path):
    """buildah with images of its own, as it works without a daemon and without networks."""
    if shutil.which("buildah") is None:
        pytest.skip(lacks("buildah"))
    places = ("--root", tmp_path / "images", "--runroot", tmp_path / "run")

    def run(*arguments):
        return call("buildah", *places, "--storage-driver", "vfs", *arguments)

    yield run
    run("rm", "--all")


@pytest.mark.fresh
def test_the_container_has_the_daemon_and_no_root(buildah, base, deb, tmp_path):
    empty = buildah("from", "scratch").strip()
    packed = tmp_path / "base.tar"
    call("tar", "-C", base.path, "-cf", packed, ".")
    buildah("add", "--quiet", empty, packed, "/")
    buildah("commit", "--quiet", empty, "localhost/base")
    context = tmp_path / "context"
    (context / "dist").mkdir(parents=True)
    shutil.copy(deb, context / "dist")
    text = CONTAINERFILE.read_text()
    last = "FROM" + text.rpartition("\nFROM")[2]
    assert last.count(BUILT) == 1
    (context / "Containerfile").write_text("ARG BASE\n" + last.replace(BUILT, "COPY dist/"))
    buildah(
        "build", "--isolation", "chroot", "--pull-never", "--build-arg", "BASE=localhost/base",
        "--tag", "sdrlinkd", context,
    )  # fmt: skip
    made = buildah("from", "--pull-never", "sdrlinkd").strip()
    told = buildah("run", "--isolation", "chroot", made, "--", "sh", "-e", "-c", USED)
    assert told.startswith("sdrlink\n")
    assert "the configuration is valid" in told
    assert "direct up" in told
    assert re.search('"Cmd": .*"sdrlinkd"', re.sub(r"\s+", " ", buildah("inspect", "sdrlinkd")))


def test_the_first_stage_has_what_a_build_needs():
    first = CONTAINERFILE.read_text().partition("\nFROM")[2].partition("\nFROM")[0]
    named = re.search(r"--no-install-recommends \\\n(.*)", first)[1].split()
    assert tuple(named) == BUILDER
    assert "RUN make -C /src deb" in first
