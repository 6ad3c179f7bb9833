"""The package's life: an upgrade keeps what is the user's, a purge leaves nothing."""

import re
import shutil

import pytest

from tests.machine import lacks
from tests.packages.debian import call

CONFIG = "/etc/sdrlinkd/sdrlinkd.toml"
REGISTRY = "/etc/sdrlinkd/registry.csv"
OLDER = "0.0.1"
WANTED = "/etc/systemd/system/multi-user.target.wants/sdrlinkd.service"


@pytest.fixture
def debian(ready, tmp_path):
    """A system of the test's own."""
    yield ready.copy(tmp_path / "root")
    shutil.rmtree(tmp_path / "root")


@pytest.fixture
def older(light, tmp_path):
    """A package of an older version, with a file and a configuration that are no more."""

    def change(tree):
        control = tree / "DEBIAN/control"
        control.write_text(re.sub("(?m)^Version: .*", f"Version: {OLDER}", control.read_text()))
        (tree / "opt/sdrlinkd/dropped.py").touch()
        (tree / REGISTRY.lstrip("/")).write_text("scan,a/B\n")

    return light(tmp_path, change)


def enable(debian):
    """As a person does with systemctl."""
    if shutil.which("systemctl") is None:
        pytest.skip(lacks("systemd"))
    call("systemctl", f"--root={debian.path}", "enable", "sdrlinkd.service")


def test_a_removal_keeps_the_configuration_and_a_purge_leaves_nothing(debian, deb):
    before = debian.files()
    debian.install(deb)
    # Whatever a robot has after a year.
    enable(debian)
    debian.run(
        "sdrlinkctl phy info; sdrlinkctl doctor || true; sdrlinkd --check;"
        "touch /opt/sdrlinkd/more.py /etc/sdrlinkd/keys.toml /etc/sdrlinkd/two.toml;"
        "mkdir -p /var/lib/sdrlinkd /var/lib/sdrlinkd-two /var/cache/sdrlinkd;"
        "chown sdrlink: /var/lib/sdrlinkd; touch /var/lib/sdrlinkd/state"
    )
    debian.run(f"echo '# mine' >> {CONFIG}; apt-get remove -y -q sdrlinkd")
    assert not (debian.path / "opt/sdrlinkd").exists()
    assert (debian.path / CONFIG.lstrip("/")).read_text().endswith("# mine\n")
    debian.run("apt-get purge -y -q sdrlinkd")
    after = debian.files()
    assert sorted(after.keys() ^ before.keys()) == []
    # Programs that change users keep the file as it was before with a dash.
    changed = [path for path in before if before[path] != after[path] and not path.endswith("-")]
    assert changed == []


def test_an_upgrade_keeps_what_was_changed_and_enabled(debian, older, light, tmp_path):
    debian.install(older)
    enable(debian)
    debian.run(f"echo '# mine' >> {CONFIG}")
    uid = debian.run("id -u sdrlink")
    # Nothing of this is about the libraries.
    (tmp_path / "newer").mkdir()
    told = debian.install(light(tmp_path / "newer"))
    assert f"over ({OLDER})" in told
    assert (debian.path / CONFIG.lstrip("/")).read_text().endswith("# mine\n")
    assert "a/B" not in (debian.path / REGISTRY.lstrip("/")).read_text()
    assert not (debian.path / "opt/sdrlinkd/dropped.py").exists()
    assert (debian.path / WANTED.lstrip("/")).is_symlink()
    assert debian.run("id -u sdrlink") == uid
